#include "clients/tubectl/run/run_recorder.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

const MonotonicTime kBegin = from_ns(50'000'000'000);

RoomDescription two_cameras() {
  RoomDescription room;
  for (const char* const name : {"A", "B"}) {
    CameraCalibration camera;
    camera.name = name;
    camera.width = camera.height = 64;
    camera.fx = camera.fy = 1000;
    room.cameras.push_back(camera);
  }
  InstrumentDescription instrument;
  instrument.id = "cath-1";
  instrument.diameter_mm = 2;
  instrument.length_mm = 100;
  instrument.coils = {{1, 10, false}, {2, 60, false}};
  room.instruments = {instrument};
  return room;
}

ImageFrame image_at(MonotonicTime exposure, std::uint8_t grey, PixelDepth depth = PixelDepth::kGrey8) {
  ImageFrame image;
  image.reserve(64, 64);
  image.exposure = exposure;
  image.fluoroscopy_on = true;
  image.depth = depth;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = static_cast<std::uint8_t>(grey + i % 7);
  return image;
}

SequenceMeasurement measurement_at(double x_mm) {
  SequenceMeasurement measurement;
  measurement.coil_count = 2;
  for (std::size_t k = 0; k < 2; ++k) {
    measurement.coils.at(k).status = CoilStatus::kOk;
    measurement.coils.at(k).p_em_mm = {x_mm, 1, 2};
    measurement.coils.at(k).tangent_em = {0, 0, 1};
  }
  return measurement;
}

class RunRecorderTest : public testing::Test {
 protected:
  RunRecorder& recorder() {
    if (!recorder_) {
      recorder_ = std::make_unique<RunRecorder>(folder(), "a test", two_cameras(), kBegin, encoders_);
    }
    return *recorder_;
  }
  void use_encoders(int count) { encoders_ = count; }
  [[nodiscard]] std::filesystem::path folder() const { return temporary_.path() / "run"; }
  Sequence finished() {
    recorder().finish();
    return read_sequence(folder());
  }
  void wait_until_written(std::uint64_t measurements) {
    for (int i = 0; i < 1000 && recorder().counts().measurements < measurements; ++i) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    ASSERT_GE(recorder().counts().measurements, measurements);
  }

 private:
  TemporaryFolder temporary_;
  int encoders_ = RunRecorder::usual_encoders();
  std::unique_ptr<RunRecorder> recorder_;
};

TEST_F(RunRecorderTest, SourcesThatAreLateAreWrittenInTheOrderOfTime) {
  recorder().add(1, image_at(kBegin + milliseconds(140), 9));
  std::this_thread::sleep_for(milliseconds(30));  // it is not written yet
  recorder().add(0, image_at(kBegin + milliseconds(100), 50));
  recorder().add(kBegin + milliseconds(120), measurement_at(7));
  const Sequence sequence = finished();
  ASSERT_EQ(sequence.frames.size(), 2U);
  EXPECT_EQ(sequence.frames[0].camera, 0);
  EXPECT_DOUBLE_EQ(sequence.frames[0].t_s, 0.1);
  EXPECT_EQ(sequence.frames[1].camera, 1);
  ASSERT_EQ(sequence.measurements.size(), 1U);
  EXPECT_DOUBLE_EQ(sequence.measurements[0].t_s, 0.12);
  EXPECT_EQ(sequence.measurements[0].coils[1].p_em_mm, Eigen::Vector3d(7, 1, 2));
}

TEST_F(RunRecorderTest, PixelsAndGeometryAreThoseThatCame) {
  for (const PixelDepth depth : {PixelDepth::kGrey8, PixelDepth::kGrey16}) {
    ImageFrame image = image_at(kBegin + milliseconds(depth == PixelDepth::kGrey8 ? 10 : 20), 100, depth);
    if (depth == PixelDepth::kGrey16) {
      image.geometry = geometry_of(two_cameras().cameras[0]);
      image.geometry->fx = 1234;
    }
    recorder().add(0, image);
  }
  recorder().add(kBegin, measurement_at(0));
  const Sequence sequence = finished();
  ASSERT_EQ(sequence.frames.size(), 2U);
  for (const SequenceFrame& frame : sequence.frames) {
    const GreyImage read = read_image(sequence, frame);
    const ImageFrame given = image_at(kBegin, 100, read.depth);
    EXPECT_TRUE(std::equal(read.pixels.begin(), read.pixels.end(), given.pixels.begin())) << frame.frame;
  }
  EXPECT_FALSE(sequence.frames[0].geometry.has_value());
  ASSERT_TRUE(sequence.frames[1].geometry.has_value());
  EXPECT_EQ(sequence.frames[1].geometry->fx, 1234);
}

/// Several threads encode, a small picture sooner than a large one before it.
TEST_F(RunRecorderTest, PicturesThatAreEncodedTogetherAreWrittenInTheOrderOfTime) {
  use_encoders(4);
  for (int i = 0; i < 60; ++i) {
    const auto depth = i % 3 == 0 ? PixelDepth::kGrey16 : PixelDepth::kGrey8;
    recorder().add(i % 2, image_at(kBegin + milliseconds(10 * i), static_cast<std::uint8_t>(i), depth));
    recorder().add(kBegin + milliseconds(10 * i), measurement_at(i));
  }
  const Sequence sequence = finished();
  ASSERT_EQ(sequence.frames.size(), 60U);
  for (std::size_t i = 0; i < 60; ++i) {
    EXPECT_NEAR(sequence.frames[i].t_s, 0.01 * static_cast<double>(i), 1e-9);
    EXPECT_EQ(read_image(sequence, sequence.frames[i]).pixels[0], i);
  }
  EXPECT_EQ(recorder().counts().waiting_bytes, 0U);
}

TEST_F(RunRecorderTest, WhatWasWrittenIsThereWhateverEndsTheProgram) {
  recorder().add(kBegin + milliseconds(100), measurement_at(1));
  recorder().add(0, image_at(kBegin + milliseconds(110), 42));
  recorder().add(kBegin + milliseconds(120), measurement_at(2));
  recorder().add(kBegin + milliseconds(2000), measurement_at(3));
  wait_until_written(2);
  const Sequence sequence = read_sequence(folder());  // nobody has called finish()
  ASSERT_EQ(sequence.measurements.size(), 2U);
  EXPECT_EQ(sequence.measurements[1].coils[0].p_em_mm.x(), 2);
  ASSERT_EQ(sequence.frames.size(), 1U);
  EXPECT_EQ(read_image(sequence, sequence.frames[0]).pixels[0], 42);
}

TEST_F(RunRecorderTest, WhatCameBeforeTheBeginningOrWasOvertakenIsLeftOut) {
  recorder().add(kBegin - milliseconds(1), measurement_at(0));
  recorder().add(kBegin + milliseconds(100), measurement_at(1));
  recorder().add(kBegin + milliseconds(2000), measurement_at(2));
  wait_until_written(1);
  recorder().add(kBegin + milliseconds(50), measurement_at(3));
  const Sequence sequence = finished();
  ASSERT_EQ(sequence.measurements.size(), 2U);
  EXPECT_EQ(sequence.measurements[0].coils[0].p_em_mm.x(), 1);
  EXPECT_EQ(sequence.measurements[1].coils[0].p_em_mm.x(), 2);
  EXPECT_EQ(recorder().counts().late, 1U);
  EXPECT_EQ(recorder().counts().early, 1U);
}

TEST_F(RunRecorderTest, AnInstantWithoutRadiationHasNoFile) {
  ImageFrame off = image_at(kBegin + milliseconds(10), 1);
  off.fluoroscopy_on = false;
  recorder().add(0, off);
  recorder().add(kBegin, measurement_at(0));
  const Sequence sequence = finished();
  ASSERT_EQ(sequence.frames.size(), 1U);
  EXPECT_FALSE(sequence.frames[0].fluoroscopy_on());
}

TEST_F(RunRecorderTest, AFolderThatGoesAwayIsTold) {
  recorder().add(kBegin, measurement_at(0));
  std::filesystem::remove_all(folder() / "images");
  recorder().add(0, image_at(kBegin + milliseconds(10), 1));
  EXPECT_THROW(recorder().finish(), SequenceError);
  EXPECT_TRUE(recorder().counts().has_failed);
}

}  // namespace
}  // namespace tubed
