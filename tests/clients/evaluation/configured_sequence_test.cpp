#include "clients/evaluation/configured_sequence.hpp"

#include <gtest/gtest.h>

#include "daemon/config/load_configuration.hpp"

namespace tubed {
namespace {

const char* const kConfiguration = R"(
[em]
driver = "simulation"
T_world_em = [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[[camera]]
name = "B"
width = 64
height = 64
fx = 1000.0
fy = 1000.0
cx = 32.0
cy = 32.0
T_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 900], [0, 0, 0, 1]]
driver = "simulation"
[[camera]]
name = "A"
width = 400
height = 600
fx = 2100.0
fy = 2100.0
cx = 200.0
cy = 300.0
geometry = "GEOMETRY"
T_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1100], [0, 0, 0, 1]]
driver = "simulation"
[[instrument]]
id = "other"
[[instrument.coil]]
sensor = 1
offset_from_tip_mm = 10.0
[[instrument]]
id = "cath-1"
mode = "joint"
[[instrument.coil]]
sensor = 1
offset_from_tip_mm = 12.0
[estimator]
image_stale_ms = 300.0
sigma_position_mm = 1.5
[frangi]
area = "frame"
[simulation]
)";

Configuration configuration(const std::string& geometry = "image") {
  std::string text = kConfiguration;
  text.replace(text.find("GEOMETRY"), 8, geometry);
  return parse_configuration(text, "room.toml");
}

/// One camera "A" and one frame with a geometry of its own.
Sequence recorded() {
  Sequence sequence;
  CameraCalibration camera;
  camera.name = "A";
  camera.width = 400;
  camera.height = 600;
  camera.fx = camera.fy = 2000;
  camera.T_camera_world.translation().z() = 1200;
  sequence.room.cameras = {camera};
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  catheter.coils = {{1, 10, false}};
  sequence.room.instruments = {catheter};
  SequenceFrame frame;
  frame.frame = 7;
  frame.geometry = geometry_of(camera);
  sequence.frames = {frame};
  return sequence;
}

TEST(ConfiguredSequence, WhatACamerasStampsAreLateByIsTakenOffAndFramesStayInOrder) {
  Sequence sequence = recorded();
  sequence.room.cameras.push_back(sequence.room.cameras[0]);
  sequence.room.cameras[1].name = "B";
  sequence.room.cameras[1].width = sequence.room.cameras[1].height = 64;
  SequenceFrame of_b = sequence.frames[0];
  sequence.frames[0].t_s = 1.00;
  of_b.frame = 8;
  of_b.t_s = 1.02;
  of_b.camera = 1;
  sequence.frames.push_back(of_b);
  Configuration room = configuration();
  room.room.cameras[0].time_offset_ms = 45;  // B

  const ConfiguredSequence run = as_configured(sequence, room);

  ASSERT_EQ(run.sequence.frames.size(), 2U);
  EXPECT_EQ(run.sequence.frames[0].frame, 8U);
  EXPECT_NEAR(run.sequence.frames[0].t_s, 0.975, 1e-12);
  EXPECT_EQ(run.sequence.frames[1].t_s, 1.00);
}

TEST(ConfiguredSequence, TheRoomIsTheConfigurationsAndWhatWasRecordedStays) {
  const ConfiguredSequence run = as_configured(recorded(), configuration());
  ASSERT_EQ(run.sequence.room.cameras.size(), 1U);
  EXPECT_EQ(run.sequence.room.cameras[0].name, "A");
  EXPECT_EQ(run.sequence.room.cameras[0].fx, 2100);
  EXPECT_EQ(run.sequence.room.T_world_em.translation().x(), 5);
  ASSERT_EQ(run.sequence.room.instruments.size(), 1U);
  EXPECT_EQ(run.sequence.room.instruments[0].coils[0].offset_from_tip_mm, 12);
  EXPECT_TRUE(run.sequence.frames[0].geometry);
}

TEST(ConfiguredSequence, SettingsAreThoseOfItsInstrument) {
  const ConfiguredSequence run = as_configured(recorded(), configuration());
  EXPECT_EQ(run.estimator.mode, EstimatorMode::kJoint);
  EXPECT_EQ(run.estimator.sigma_position_mm, 1.5);
  EXPECT_EQ(run.frangi.area, FrangiArea::kFrame);
  EXPECT_EQ(run.max_image_timeout, std::chrono::milliseconds(300));
}

TEST(ConfiguredSequence, AConfigurationMayHoldForEveryImage) {
  EXPECT_FALSE(as_configured(recorded(), configuration("configuration")).sequence.frames[0].geometry);
}

TEST(ConfiguredSequence, WhatDoesNotFitIsNamed) {
  const auto complaint = [](const Sequence& sequence) -> std::string {
    try {
      as_configured(sequence, configuration());
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  Sequence other_camera = recorded();
  other_camera.room.cameras[0].name = "C";
  EXPECT_NE(complaint(other_camera).find("has no [[camera]] named \"C\""), std::string::npos);
  Sequence other_size = recorded();
  other_size.room.cameras[0].width = 300;
  EXPECT_NE(complaint(other_size).find("400 x 600 px, in the sequence 300 x 600 px"), std::string::npos);
  Sequence other_catheter = recorded();
  other_catheter.room.instruments[0].id = "cath-9";
  EXPECT_NE(complaint(other_catheter).find("none is \"cath-9\""), std::string::npos);
}

}  // namespace
}  // namespace tubed
