#include "daemon/image/image_checks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

namespace tubed {
namespace {

ImageFrame noisy_frame(int width, int height, unsigned seed) {
  ImageFrame frame;
  frame.reserve(width, height);
  std::mt19937 random(seed);
  for (auto& byte : frame.pixels) {
    byte = static_cast<std::uint8_t>(random() % 200);
  }
  return frame;
}

/// A door and the measurement behind it.
struct DoorBed {
  explicit DoorBed(double white_level = 0) : door(white_level) { measurement.reserve(64, 64); }
  explicit DoorBed(const CameraCalibration& camera) : door(camera) { measurement.reserve(64, 64); }
  ImageRejection take(const ImageFrame& frame) { return door.take(frame, measurement); }
  ImageDoor door;
  ImageMeasurement measurement;
};

/// Words of 16 bits: noise over `grey` .. `grey` + 63, the first `at_top` pixels `top`.
ImageFrame frame_of_words(int grey, int at_top, int top, unsigned seed) {
  ImageFrame frame;
  frame.reserve(64, 64);
  frame.depth = PixelDepth::kGrey16;
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const auto noise = grey + static_cast<int>(random() % 64);
    const auto pixel = static_cast<std::uint16_t>(i < static_cast<std::size_t>(at_top) ? top : noise);
    std::memcpy(frame.pixels.data() + 2 * i, &pixel, 2);
  }
  return frame;
}

TEST(ImageChecks, AnXRayLikeImageIsTakenAsItIs) {
  DoorBed door;
  const ImageFrame frame = noisy_frame(64, 64, 1);
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.grey[100], static_cast<float>(frame.pixels[100]));
}

TEST(ImageChecks, SixteenBitPixelsAreInHostOrder) {
  DoorBed door;
  ImageFrame frame = noisy_frame(64, 64, 1);
  frame.depth = PixelDepth::kGrey16;
  const std::uint16_t pixel = 40000;
  std::memcpy(frame.pixels.data() + 2 * 7, &pixel, 2);
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.grey[7], 40000.0F);
}

TEST(ImageChecks, AnotherSizeThanTheCamerasIsRefused) {
  DoorBed door;
  EXPECT_EQ(door.take(noisy_frame(64, 32, 1)), ImageRejection::kWrongSize);
}

/// Of 64 x 64 px, 1000 mm from the world's origin.
CameraCalibration camera_with(GeometryUse use) {
  CameraCalibration camera;
  camera.width = camera.height = 64;
  camera.fx = camera.fy = 500;
  camera.T_camera_world.translation().z() = 1000;
  camera.geometry = use;
  return camera;
}

ImageFrame frame_with_geometry(double depth_mm) {
  ImageFrame frame = noisy_frame(64, 64, 1);
  frame.geometry = geometry_of(camera_with(GeometryUse::kImage));
  frame.geometry->t_camera_world_mm[2] = depth_mm;
  return frame;
}

TEST(ImageChecks, AnImagesOwnGeometryGoesWithIt) {
  DoorBed door(camera_with(GeometryUse::kImage));
  EXPECT_EQ(door.take(frame_with_geometry(900)), ImageRejection::kNone);
  ASSERT_TRUE(door.measurement.geometry);
  EXPECT_EQ(door.measurement.geometry->t_camera_world_mm[2], 900);
  EXPECT_TRUE(door.measurement.brought_geometry);
  EXPECT_EQ(door.take(noisy_frame(64, 64, 2)), ImageRejection::kNone);  // the next one has none
  EXPECT_FALSE(door.measurement.geometry);
  EXPECT_FALSE(door.measurement.brought_geometry);
}

TEST(ImageChecks, AGeometryThatCannotBeIsRefusedWithWordsAndTheNextImageIsTaken) {
  DoorBed door(camera_with(GeometryUse::kImage));
  EXPECT_EQ(door.take(frame_with_geometry(-900)), ImageRejection::kWrongGeometry);
  EXPECT_NE(std::strstr(door.door.geometry_fault(), "behind the camera"), nullptr);
  EXPECT_FALSE(door.measurement.geometry);
  EXPECT_EQ(door.take(frame_with_geometry(900)), ImageRejection::kNone);
}

TEST(ImageChecks, AnImageWithoutTheGeometryThatIsRequiredIsRefused) {
  DoorBed door(camera_with(GeometryUse::kRequired));
  EXPECT_EQ(door.take(noisy_frame(64, 64, 1)), ImageRejection::kNoGeometry);
  EXPECT_EQ(door.take(frame_with_geometry(900)), ImageRejection::kNone);
}

TEST(ImageChecks, TheConfigurationsGeometryMayHoldForEveryImage) {
  DoorBed door(camera_with(GeometryUse::kConfiguration));
  EXPECT_EQ(door.take(frame_with_geometry(-900)), ImageRejection::kNone);
  EXPECT_FALSE(door.measurement.geometry);
}

TEST(ImageChecks, AChangedConfigurationHoldsForImagesWithoutTheirOwn) {
  DoorBed door(camera_with(GeometryUse::kImage));
  ViewGeometry changed = geometry_of(camera_with(GeometryUse::kImage));
  changed.t_camera_world_mm[0] = 33;
  door.door.look_from(changed);
  EXPECT_EQ(door.take(noisy_frame(64, 64, 1)), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.geometry, changed);
  EXPECT_FALSE(door.measurement.brought_geometry);
  ImageFrame own = frame_with_geometry(900);
  own.pixels[0] ^= 1;
  EXPECT_EQ(door.take(own), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.geometry, own.geometry);
  EXPECT_TRUE(door.measurement.brought_geometry);
}

TEST(ImageChecks, AMirroredImageIsReadFromRightToLeft) {
  CameraCalibration camera = camera_with(GeometryUse::kImage);
  camera.mirrored = true;
  DoorBed door(camera);
  const ImageFrame frame = noisy_frame(64, 64, 1);
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.grey[64 * 5 + 3], static_cast<float>(frame.pixels[64 * 5 + 60]));
}

TEST(ImageChecks, ABlackOrEvenImageIsRefused) {
  DoorBed door;
  ImageFrame frame = noisy_frame(64, 64, 1);
  std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{0});
  EXPECT_EQ(door.take(frame), ImageRejection::kBlack);
  std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{90});
  EXPECT_EQ(door.take(frame), ImageRejection::kBlack);
}

TEST(ImageChecks, AnImageThatIsMostlyAtTheTopIsSaturated) {
  DoorBed door;
  ImageFrame frame = noisy_frame(64, 64, 1);
  std::fill(frame.pixels.begin(), frame.pixels.begin() + 64 * 40, std::uint8_t{255});
  EXPECT_EQ(door.take(frame), ImageRejection::kSaturated);
}

TEST(ImageChecks, ABitEqualRepeatIsFrozenAndTheNextNewImageIsTaken) {
  DoorBed door;
  EXPECT_EQ(door.take(noisy_frame(64, 64, 1)), ImageRejection::kNone);
  EXPECT_EQ(door.take(noisy_frame(64, 64, 1)), ImageRejection::kFrozen);
  EXPECT_EQ(door.take(noisy_frame(64, 64, 2)), ImageRejection::kNone);
}

TEST(ImageChecks, ADetectorOfFewerBitsThanItsWordsIsSaturatedAtItsOwnTop) {
  for (const int top : {1023, 4095, 16383, 65535}) {
    DoorBed door;
    EXPECT_EQ(door.take(frame_of_words(top / 2, 64 * 20, top, 1)), ImageRejection::kNone) << top;
    EXPECT_EQ(door.take(frame_of_words(top / 2, 64 * 40, top, 2)), ImageRejection::kSaturated) << top;
    EXPECT_EQ(door.door.white_level(), static_cast<float>(top));
  }
}

TEST(ImageChecks, ADimImageOfATwelveBitDetectorIsNoSaturatedOneOfTen) {
  DoorBed door;
  EXPECT_EQ(door.take(frame_of_words(700, 0, 0, 1)), ImageRejection::kNone);
  EXPECT_EQ(door.door.white_level(), 1023);
  EXPECT_EQ(door.take(frame_of_words(1000, 0, 0, 2)), ImageRejection::kNone) << "the whole of it above 999";
  EXPECT_EQ(door.door.white_level(), 4095);
  EXPECT_EQ(door.take(frame_of_words(700, 64 * 40, 1023, 3)), ImageRejection::kNone)
      << "1023 is a grey value like any other by now";
}

TEST(ImageChecks, AnUnusualWhiteLevelIsKnownWhenItIsConfigured) {
  DoorBed learning;
  EXPECT_EQ(learning.take(frame_of_words(2000, 64 * 40, 3600, 1)), ImageRejection::kNone);
  DoorBed told(3600);
  EXPECT_EQ(told.take(frame_of_words(2000, 64 * 40, 3600, 1)), ImageRejection::kSaturated);
  EXPECT_EQ(told.door.white_level(), 3600);
}

TEST(ImageChecks, AFaintImageOfATwelveBitDetectorIsNotTakenForBlack) {
  DoorBed door;
  door.take(frame_of_words(2000, 0, 0, 1));
  EXPECT_EQ(door.take(frame_of_words(3000, 0, 0, 2)), ImageRejection::kNone) << "64 of 4096 grey levels";
}

TEST(ImageChecks, ADifferenceInTheLastPixelsOfAnOddSizeIsSeen) {
  ImageDoor door;
  ImageMeasurement measurement;
  measurement.reserve(67, 65);
  ImageFrame frame = noisy_frame(67, 65, 1);
  EXPECT_EQ(door.take(frame, measurement), ImageRejection::kNone);
  frame.pixels[67 * 65 - 1] ^= 1U;
  EXPECT_EQ(door.take(frame, measurement), ImageRejection::kNone);
  EXPECT_EQ(door.take(frame, measurement), ImageRejection::kFrozen);
}

TEST(ImageChecks, TheDarkestAndTheBrightestPixelAreTold) {
  DoorBed door;
  door.take(frame_of_words(700, 3, 3333, 1));
  EXPECT_EQ(door.measurement.darkest,
            *std::min_element(door.measurement.grey.begin(), door.measurement.grey.end()));
  EXPECT_GT(door.measurement.darkest, 0);
  EXPECT_EQ(door.measurement.brightest, 3333);
}

/// A door that averages squares of 4 x 4 of 67 x 66 pixels.
struct BinningBed {
  explicit BinningBed(CameraCalibration camera = panel()) : door(camera, 4) { measurement.reserve(16, 16); }
  static CameraCalibration panel() {
    CameraCalibration camera = camera_with(GeometryUse::kImage);
    camera.width = 67;
    camera.height = 66;
    return camera;
  }
  ImageDoor door;
  ImageMeasurement measurement;
};

double mean_of_square(const ImageFrame& frame, int left, int top) {
  double sum = 0;
  for (int y = top; y < top + 4; ++y) {
    for (int x = left; x < left + 4; ++x) sum += frame.pixels[static_cast<std::size_t>(y * frame.width + x)];
  }
  return sum / 16;
}

TEST(ImageChecks, ABinnedPixelIsTheMeanOfItsSquare) {
  BinningBed bed;
  const ImageFrame frame = noisy_frame(67, 66, 1);
  EXPECT_EQ(bed.door.take(frame, bed.measurement), ImageRejection::kNone);
  for (const auto& [x, y] : {std::pair(0, 0), {15, 0}, {3, 15}, {15, 15}}) {
    EXPECT_EQ(bed.measurement.grey[static_cast<std::size_t>(16 * y + x)],
              mean_of_square(frame, 4 * x, 4 * y));
  }
  const auto [least, greatest] =
      std::minmax_element(bed.measurement.grey.begin(), bed.measurement.grey.end());
  EXPECT_EQ(bed.measurement.darkest, *least);
  EXPECT_EQ(bed.measurement.brightest, *greatest);
}

TEST(ImageChecks, ABinnedImageIsMirroredBeforeItsSquaresAreLaid) {
  CameraCalibration camera = BinningBed::panel();
  camera.mirrored = true;
  BinningBed bed(camera);
  const ImageFrame frame = noisy_frame(67, 66, 1);
  EXPECT_EQ(bed.door.take(frame, bed.measurement), ImageRejection::kNone);
  EXPECT_EQ(bed.measurement.grey[16 * 2 + 1], mean_of_square(frame, 67 - 8, 8));
}

TEST(ImageChecks, AnImageOfTheMeasuredSizeIsNotOneOfTheDetectors) {
  BinningBed bed;
  EXPECT_EQ(bed.door.take(noisy_frame(16, 16, 1), bed.measurement), ImageRejection::kWrongSize);
}

TEST(ImageChecks, AGeometryIsThatOfWhatWasCopied) {
  BinningBed bed;
  ImageFrame frame = noisy_frame(67, 66, 1);
  frame.geometry = frame_with_geometry(900).geometry;
  EXPECT_EQ(bed.door.take(frame, bed.measurement), ImageRejection::kNone);
  EXPECT_EQ(bed.measurement.geometry, binned(*frame.geometry, 4));
  bed.door.look_from(*frame.geometry);
  frame.geometry.reset();
  frame.pixels[0] ^= 1;
  EXPECT_EQ(bed.door.take(frame, bed.measurement), ImageRejection::kNone);
  EXPECT_EQ(bed.measurement.geometry->fx, binned(geometry_of(BinningBed::panel()), 4).fx);
}

TEST(ImageChecks, ALinearDetectorsImageIsCopiedAsItsLogarithm) {
  CameraCalibration camera = camera_with(GeometryUse::kImage);
  camera.response = DetectorResponse::kLinear;
  camera.white_level = 4095;
  DoorBed door(camera);
  const ImageFrame frame = frame_of_words(700, 1, 4095, 1);
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  LogTable logs;
  logs.set(4095, 1);
  std::uint16_t word = 0;
  std::memcpy(&word, frame.pixels.data() + 2 * 77, 2);
  EXPECT_EQ(door.measurement.grey[77], logs[word]);
  EXPECT_EQ(door.measurement.brightest, 65535);
}

/// 256 x 256 words of 12 bits, four octaves from left to right; noise with the standard deviation of counted
/// quanta, or one that is everywhere the same.
ImageFrame ramp_of_words(bool counts_quanta, unsigned seed) {
  ImageFrame frame;
  frame.reserve(256, 256);
  frame.depth = PixelDepth::kGrey16;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < 256 * 256; ++i) {
    const double grey = 200 * std::exp2(static_cast<double>(i % 256) / 64);
    const double noise = counts_quanta ? 3 * std::sqrt(grey) : 30;
    const auto pixel = static_cast<std::uint16_t>(std::clamp(grey + noise * normal(random), 0.0, 4095.0));
    std::memcpy(frame.pixels.data() + 2 * i, &pixel, 2);
  }
  return frame;
}

TEST(ImageChecks, TheNoiseOfTheFirstImageSaysOnceAndForAllWhetherItsDetectorIsLinear) {
  for (const bool is_linear : {true, false}) {
    CameraCalibration camera = camera_with(GeometryUse::kImage);
    camera.width = camera.height = 256;
    ImageDoor door(camera);
    ImageMeasurement measurement;
    measurement.reserve(256, 256);
    EXPECT_EQ(door.take(ramp_of_words(is_linear, 1), measurement), ImageRejection::kNone);
    EXPECT_EQ(door.is_linear(), is_linear);
    EXPECT_EQ(door.take(ramp_of_words(!is_linear, 2), measurement), ImageRejection::kNone);
    EXPECT_EQ(door.is_linear(), is_linear);
  }
}

TEST(ImageChecks, ImagesOfEightBitsAreTakenAsTheyAreWhateverTheirNoise) {
  CameraCalibration camera = camera_with(GeometryUse::kImage);
  DoorBed door(camera);
  ImageFrame frame;
  frame.reserve(64, 64);
  std::mt19937 random(3);
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const std::size_t grey = 10 + 3 * (i % 64);
    frame.pixels[i] = static_cast<std::uint8_t>(grey + random() % (1 + grey / 8));
  }
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  EXPECT_FALSE(door.door.is_linear());
  EXPECT_EQ(door.measurement.grey[100], static_cast<float>(frame.pixels[100]));
}

}  // namespace
}  // namespace tubed
