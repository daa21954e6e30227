#include "clients/calibration/found_view.hpp"

#include <gtest/gtest.h>

#include "clients/calibration/coil_recording.hpp"

namespace tubed {
namespace {

RoomDescription two_cameras() {
  RoomDescription room;
  for (const char* name : {"A", "B"}) {
    CameraCalibration camera;
    camera.name = name;
    camera.width = 400;
    camera.height = 600;
    camera.fx = camera.fy = 2000;
    room.cameras.push_back(camera);
  }
  return room;
}

/// With the images of both cameras, of which the second one was found.
TubeEstimate found_estimate() {
  TubeEstimate estimate;
  estimate.reasons.add(Reason::kGeometryChanged);
  estimate.view_count = 2;
  estimate.views[1].camera = 1;
  estimate.views[1].has_own_geometry = true;
  estimate.views[1].focal_length_px = {2100, 2100};
  estimate.views[1].T_camera_world = {1, 0, 0, 12.5, 0, 1, 0, -3, 0, 0, 1, 1200, 0, 0, 0, 1};
  estimate.views[1].sigma_translation_mm = {0.5F, 1.5F, 4};
  estimate.views[1].sigma_rotation_rad = {0.01F, 0.02F, 0.001F};
  return estimate;
}

const SettingValue* value_of(const ConfigurationFragment& fragment, const std::string& path) {
  for (const FoundValue& found : fragment.values) {
    if (found.path == path) return &found.value;
  }
  return nullptr;
}

TEST(FoundView, IsTheOneWhosePoseIsNotTheConfigurations) {
  const auto found = found_view_in(found_estimate(), two_cameras(), "");
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->camera, "B");
  EXPECT_NEAR(found->focal_ratio, 1.05, 1e-12);
}

TEST(FoundView, AnotherCameraIsNotTheOneThatIsAskedFor) {
  EXPECT_FALSE(found_view_in(found_estimate(), two_cameras(), "A").has_value());
}

// Its image says itself how it stands.
TEST(FoundView, WhereNothingMovedNoneIsFound) {
  TubeEstimate estimate = found_estimate();
  estimate.reasons = Reasons{};
  EXPECT_FALSE(found_view_in(estimate, two_cameras(), "").has_value());
}

TEST(FoundView, OfTwoOneHasToBeNamed) {
  TubeEstimate estimate = found_estimate();
  estimate.views[0].has_own_geometry = true;
  EXPECT_THROW(found_view_in(estimate, two_cameras(), ""), CalibrationError);
  EXPECT_TRUE(found_view_in(estimate, two_cameras(), "B").has_value());
}

// The pose that it had would be wrong.
TEST(FoundView, AViewThatIsBackIsNotOffered) {
  const RoomDescription room = two_cameras();
  FoundViewSearch search(room, "");
  TubeEstimate estimate = found_estimate();
  search.take(estimate);
  ASSERT_TRUE(search.found().has_value());
  estimate.reasons = Reasons{};
  search.take(estimate);
  EXPECT_FALSE(search.found().has_value());
  EXPECT_TRUE(search.has_moved());
}

TEST(FoundView, AViewThatIsLostForASecondHasMovedOn) {
  const RoomDescription room = two_cameras();
  FoundViewSearch search(room, "");
  TubeEstimate estimate = found_estimate();
  search.take(estimate);
  estimate.views[1].has_own_geometry = false;
  estimate.valid_time_ns = 500'000'000;
  search.take(estimate);
  EXPECT_TRUE(search.found().has_value()) << "for a moment";
  estimate.valid_time_ns = 1'500'000'000;
  search.take(estimate);
  EXPECT_FALSE(search.found().has_value());
}

TEST(FoundView, AModeThatDoesNotLookForItIsRefused) {
  ConfiguredSequence run;
  run.estimator.mode = EstimatorMode::kPaper;
  EXPECT_THROW(find_view(run, ""), CalibrationError);
}

TEST(FoundView, BecomesThePoseOfItsCameraWithItsSigma) {
  const ConfigurationFragment fragment = fragment_of(*found_view_in(found_estimate(), two_cameras(), ""));
  ASSERT_NE(value_of(fragment, "camera[B].T_camera_world"), nullptr);
  EXPECT_EQ(std::get<Eigen::Matrix4d>(*value_of(fragment, "camera[B].T_camera_world"))(0, 3), 12.5);
  EXPECT_EQ(std::get<std::vector<double>>(*value_of(fragment, "camera[B].pose_sigma_mm")),
            (std::vector<double>{0.5, 1.5, 4}));
  EXPECT_NEAR(std::get<std::vector<double>>(*value_of(fragment, "camera[B].pose_sigma_deg"))[1], 1.1459,
              1e-4);
  ASSERT_NE(value_of(fragment, "camera[B].fx"), nullptr) << "the magnification changed";
}

TEST(FoundView, WithoutAnotherMagnificationTheFocalLengthStays) {
  TubeEstimate estimate = found_estimate();
  estimate.views[1].focal_length_px = {2000, 2000};
  const ConfigurationFragment fragment = fragment_of(*found_view_in(estimate, two_cameras(), ""));
  EXPECT_EQ(value_of(fragment, "camera[B].fx"), nullptr);
}

TEST(FoundView, ARecordingInWhichNothingMovesIsRefused) {
  ConfiguredSequence run;
  run.sequence.room = two_cameras();
  InstrumentDescription instrument;
  instrument.id = "cath-1";
  instrument.length_mm = 380;
  instrument.coils.push_back({1, 10, false});
  run.sequence.room.instruments = {instrument};
  try {
    find_view(run, "");
    FAIL() << "found in nothing";
  } catch (const CalibrationError& error) {
    EXPECT_NE(std::string(error.what()).find("no view moved"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tubed
