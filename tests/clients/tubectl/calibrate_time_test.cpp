// `tubectl calibrate time` on recordings of a straight tube that is drawn into images and measured by coils.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "clients/tubectl/verbs.hpp"
#include "drivers/replay/sequence_writer.hpp"
#include "tests/clients/tubectl/calibrate_outcome.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

constexpr int kWidth_px = 160;
constexpr int kHeight_px = 200;

/// One pixel is one mm; the tube points up, its end about 60 px below the image's upper border.
RoomDescription room() {
  RoomDescription room;
  CameraCalibration camera;
  camera.name = "A";
  camera.width = kWidth_px;
  camera.height = kHeight_px;
  camera.fx = camera.fy = 1000;
  camera.cx = 80;
  camera.cy = 60;
  camera.T_camera_world.translation().z() = 1000;
  room.cameras = {camera};
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  catheter.diameter_mm = 4;
  catheter.length_mm = 120;
  catheter.coils = {{.sensor = 1, .offset_from_tip_mm = 10},
                    {.sensor = 2, .offset_from_tip_mm = 50},
                    {.sensor = 3, .offset_from_tip_mm = 90}};
  room.instruments = {catheter};
  return room;
}

struct Hand {
  double across_mm = 6;
  double along_mm = 8;
  [[nodiscard]] Eigen::Vector3d tip_mm(double t_s) const {
    const auto wave = [t_s](double rate_hz, double phase) {
      return std::sin(2 * std::numbers::pi * rate_hz * t_s + phase);
    };
    return {across_mm * (wave(0.53, 0) + 0.5 * wave(1.13, 1)),
            along_mm * (wave(0.41, 2) + 0.4 * wave(0.97, 3)), 0};
  }
};

GreyImage picture_of(const Eigen::Vector3d& tip_mm, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 4);
  GreyImage image;
  image.width = kWidth_px;
  image.height = kHeight_px;
  image.depth = PixelDepth::kGrey8;
  const auto edge = [](double inside_px) { return 0.5 * std::erfc(-inside_px / 0.8); };
  for (int y = 0; y < kHeight_px; ++y) {
    for (int x = 0; x < kWidth_px; ++x) {
      const double across_px = std::abs(x - 80 - tip_mm.x());
      const double dark = edge(2 - across_px) * edge(y - 60 - tip_mm.y());
      image.pixels.push_back(
          static_cast<std::uint8_t>(std::clamp(160 + 0.2 * x - 70 * dark + noise(random), 1.0, 254.0)));
    }
  }
  return image;
}

/// 20 s at 15 images and, unless told otherwise, 40 measurements a second; images are stamped `late_s` too
/// late, coils err by 0.2 mm.
void write_recording(const std::filesystem::path& folder, const Hand& hand, double late_s,
                     double duration_s = 20, double interval_s = 0.025) {
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0, 0.2);
  SequenceWriter writer(folder, "a tube is moved", room());
  std::uint32_t frame = 0;
  for (double t_s = 0.5; t_s < duration_s; t_s += 1.0 / 15) {
    writer.add_exposure(++frame, t_s + late_s, 0, picture_of(hand.tip_mm(t_s), random));
  }
  std::uint32_t number = 0;
  for (double t_s = 0; t_s < duration_s + 1; t_s += interval_s) {
    SequenceMeasurement measurement;
    measurement.t_s = t_s;
    measurement.em_frame = ++number;
    measurement.coil_count = 3;
    for (std::size_t k = 0; k < 3; ++k) {
      CoilSample& coil = measurement.coils[k];
      coil.status = CoilStatus::kOk;
      coil.p_em_mm =
          hand.tip_mm(t_s) +
          Eigen::Vector3d(noise(random), 10 + 40.0 * static_cast<double>(k) + noise(random), noise(random));
      coil.tangent_em = -Eigen::Vector3d::UnitY();
    }
    writer.add_measurement(measurement);
  }
  writer.finish();
}

CalibrateOutcome calibrate_time(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "time");
  return calibrate(std::move(arguments));
}

TEST(CalibrateTime, ATubeThatIsMovedSaysByHowMuchStampsAreLate) {
  const TemporaryFolder folder;
  write_recording(folder.path() / "run", {}, 0.037);

  const CalibrateOutcome outcome = calibrate_time({(folder.path() / "run").string(), "--json", "-"});

  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  const auto found = nlohmann::json::parse(outcome.out)["cameras"][0];
  EXPECT_NEAR(found["time_offset_ms"], 37, 3 * found["time_offset_sigma_ms"].get<double>());
  EXPECT_LT(found["time_offset_sigma_ms"], 5);
}

TEST(CalibrateTime, StampsThatAreFarTooEarlyAreFoundToo) {
  const TemporaryFolder folder;
  write_recording(folder.path() / "run", {}, -0.26);

  const CalibrateOutcome outcome =
      calibrate_time({(folder.path() / "run").string(), "--report", (folder.path() / "page.svg").string()});

  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(outcome.out.find("time_offset_ms = -2"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("cannot be stamped before they are exposed"), std::string::npos) << outcome.out;
  EXPECT_NE(folder.read("page.svg").find("</svg>"), std::string::npos);
}

TEST(CalibrateTime, WhatCannotTellTheOffsetIsMetWithWords) {
  const TemporaryFolder folder;
  const std::string run = (folder.path() / "run").string();
  const auto refused_with = [&](const std::string& words, std::vector<std::string> further = {}) {
    further.insert(further.begin(), run);
    const CalibrateOutcome outcome = calibrate_time(further);
    EXPECT_EQ(outcome.exit_code, kExitBadData) << words << outcome.out;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out.find("time_offset_ms"), std::string::npos);
  };

  write_recording(run, {.across_mm = 0.05, .along_mm = 0.05}, 0.02);
  refused_with("Move the tip to and fro");
  refused_with("has no camera \"B\"; it has \"A\"", {"--camera", "B"});

  std::filesystem::remove_all(run);
  write_recording(run, {}, 0.8, 12);
  refused_with("camera A:");

  std::filesystem::remove_all(run);
  write_recording(run, {}, 0.02, 2);
  refused_with("record half a minute");

  std::filesystem::remove_all(run);
  write_recording(run, {}, 0.02, 20, 1.0 / 15);
  refused_with("coils were measured every 67 ms only, every 45 ms are needed");
}

TEST(CalibrateTime, ARecordingWithoutImagesIsRefused) {
  const StraightSequence sequence(3);

  const CalibrateOutcome outcome = calibrate_time({sequence.path()});

  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.err.find("camera A: the recording has no image of it"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tubed
