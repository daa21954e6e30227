#include "daemon/image/image_checks.hpp"

#include <gtest/gtest.h>

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
  EXPECT_EQ(door.take(noisy_frame(64, 64, 2)), ImageRejection::kNone);  // the next one has none
  EXPECT_FALSE(door.measurement.geometry);
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
  ImageFrame own = frame_with_geometry(900);
  own.pixels[0] ^= 1;
  EXPECT_EQ(door.take(own), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.geometry, own.geometry);
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

}  // namespace
}  // namespace tubed
