// That every key reaches the field it is meant for, and what is only warned of.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/config/load_configuration.hpp"
#include "daemon/config/schema.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

std::string base() {
  std::ifstream in(fs::path(TUBED_SOURCE_DIR) / "tests/daemon/config/base.toml");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Replaces the first `find` of `text`.
void replace(std::string& text, const std::string& find, const std::string& replacement) {
  text.replace(text.find(find), find.size(), replacement);
}

std::string base_with(const std::string& find, const std::string& replacement) {
  std::string text = base();
  replace(text, find, replacement);
  return text;
}

/// Everything the loader says about `text`; empty when it is taken.
std::string complaint(const std::string& text, const std::vector<DriverDescription>& available = drivers()) {
  try {
    parse_configuration(text, "room.toml", available);
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "";
}

TEST(Assemble, EveryStageGetsItsOwnPriorityAndCpus) {
  const Configuration configuration = parse_configuration(
      base_with("[realtime.optimizer]\npriority = 0\ncpus = []",
                "em_acquisition = {priority = 1, cpus = [0]}\nimage_grab = {priority = 2}\n"
                "frangi = {priority = 3}\noptimizer = {priority = 4}\npublisher = {priority = 5}"),
      "room.toml");

  EXPECT_EQ(configuration.pipeline.em_acquisition.fifo_priority, 1);
  EXPECT_EQ(configuration.pipeline.em_acquisition.cpus, std::vector<int>{0});
  EXPECT_EQ(configuration.pipeline.image_grab.fifo_priority, 2);
  EXPECT_EQ(configuration.pipeline.frangi.fifo_priority, 3);
  EXPECT_EQ(configuration.pipeline.optimizer.fifo_priority, 4);
  EXPECT_EQ(configuration.pipeline.publisher.fifo_priority, 5);
}

const std::string kPoseKeys = "fx = 2000.0\nfy = 2000.0\n";
const std::string kPoseRow = "T_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, 1]]\n";

/// base.toml with a C-arm in the place of focal lengths and pose.
std::string with_c_arm(const std::string& further = "") {
  std::string text = base_with(kPoseKeys, "");
  replace(text, kPoseRow, "");
  replace(text, "[[instrument]]",
          "[camera.c_arm]\nsource_detector_mm = 1200\nsource_isocentre_mm = 785\npixel_pitch_mm = 0.6\n"
          "primary_angle_deg = 30\ntable_mm = [0, 0, 40]\nzoom = 1.25\n" +
              further + "\n[[instrument]]");
  return text;
}

TEST(Assemble, ACArmPlacesItsCamera) {
  const CameraCalibration camera = parse_configuration(with_c_arm(), "room.toml").room.cameras.front();
  EXPECT_DOUBLE_EQ(camera.fx, 1.25 * 1200 / 0.6);
  EXPECT_EQ(camera.cx, 200);
  EXPECT_EQ(camera.source_isocentre_mm, 785);
  // The detector at LAO 30: the beam goes to the patient's left front; the table is 40 mm further to the
  // head.
  const Eigen::Vector3d source_world_mm = camera.T_camera_world.inverse().translation();
  EXPECT_TRUE(source_world_mm.isApprox(Eigen::Vector3d(-785 * 0.5, 785 * std::sqrt(0.75), -40), 1e-9));
}

TEST(Assemble, ACArmAndAPoseAreTwoAnswersToOneQuestion) {
  std::string text = with_c_arm();
  replace(text, "cx = 200.0", "fx = 2000.0\ncx = 200.0");
  EXPECT_NE(complaint(text).find("camera[0].fx"), std::string::npos) << complaint(text);
  EXPECT_NE(complaint(text).find("means nothing beside camera[0].c_arm"), std::string::npos);
}

TEST(Assemble, WithoutACArmThePoseIsStillRequired) {
  EXPECT_NE(complaint(base_with(kPoseRow, "")).find("camera[0].T_camera_world"), std::string::npos);
}

TEST(Assemble, AnIsocentreBehindTheDetectorIsRefused) {
  std::string text = with_c_arm();
  replace(text, "source_isocentre_mm = 785", "source_isocentre_mm = 1300");
  EXPECT_NE(complaint(text).find("camera[0].c_arm.source_isocentre_mm"), std::string::npos);
}

TEST(Assemble, WhoseGeometryHoldsIsAWordOfTheCamera) {
  const auto use = [](const std::string& line) {
    return parse_configuration(base_with("cx = 200.0", line + "cx = 200.0"), "room.toml")
        .room.cameras.front()
        .geometry;
  };
  EXPECT_EQ(use(""), GeometryUse::kImage);
  EXPECT_EQ(use("geometry = \"required\"\n"), GeometryUse::kRequired);
  EXPECT_EQ(use("geometry = \"configuration\"\n"), GeometryUse::kConfiguration);
}

TEST(Assemble, PosesTakeEffectAtOnceAndSizesWithARestart) {
  const TableDescription file = configuration_schema(drivers());
  for (const char* key : {"camera[1].T_camera_world", "camera[1].fx", "camera[2].cy",
                          "camera[1].c_arm.primary_angle_deg", "camera[1].c_arm.table_mm"}) {
    EXPECT_TRUE(takes_effect_at_once(file, key)) << key;
  }
  for (const char* key : {"camera[1].width", "camera[1].distortion", "camera[1].geometry"}) {
    EXPECT_FALSE(takes_effect_at_once(file, key)) << key;
  }
}

TEST(Assemble, DaemonSchedulingBackOffAndDdsAreAsWritten) {
  std::string text = base_with("log_level = \"info\"\nrate_hz = 30.0\ntick_grace_ms = 10.0",
                               "log_level = \"error\"\nrate_hz = 25\ntick_grace_ms = 7");
  replace(text, "\"optional\"", "\"required\"");
  replace(text, "domain = 0", "domain = 9\nworld_frame = \"table\"\nworld_axes = \"LPS\"");
  replace(text, "\"lo\"", "\"eth1\"");
  replace(text, "reconnect_first_ms = 100.0", "reconnect_first_ms = 200");
  replace(text, "2000.0", "3000");

  const Configuration configuration = parse_configuration(text, "room.toml");

  EXPECT_EQ(configuration.log_level, "error");
  EXPECT_EQ(configuration.pipeline.rate_hz, 25);
  EXPECT_EQ(configuration.pipeline.tick_grace_ms, 7);
  EXPECT_FALSE(configuration.pipeline.scheduling_optional);
  EXPECT_EQ(configuration.pipeline.reconnect_first_ms, 200);
  EXPECT_EQ(configuration.pipeline.reconnect_last_ms, 3000);
  EXPECT_EQ(configuration.dds.domain, 9);
  EXPECT_EQ(configuration.dds.world_frame, "table");
  EXPECT_EQ(configuration.dds.world_axes, "LPS");
  EXPECT_EQ(configuration.dds.network_interface, "eth1");
}

TEST(Assemble, EveryKeyOfEstimatorAndFrangiReachesItsField) {
  std::string text = base();
  text.erase(text.find("[estimator]"), text.find("[simulation]") - text.find("[estimator]"));
  text +=
      "[estimator]\nmode = \"em\"\ncoefficient_count = 20\nsigma_position_mm = 1.5\nsigma_tangent = 0.25\n"
      "sigma_strain_sqrt_mm = 0.5\nbending_q_per_mm = 0.125\nsigma_image_px = 2.5\nimage_search_px = 9\n"
      "image_likelihood = \"posterior\"\n"
      "image_temper = 3\nem_stale_ms = 210\nem_stuck_ms = 220\nimage_stale_ms = 230\niterations = 5\n"
      "[frangi]\nscales_px = [2, 4]\nbeta = 0.75\nstructureness = 12\npolarity = \"bright\"\n"
      "smoothing = \"integer16\"\narea = \"frame\"\n";

  const Configuration configuration = parse_configuration(text, "room.toml");

  const EstimatorSettings& estimator = configuration.estimators.at(0);
  EXPECT_EQ(estimator.mode, EstimatorMode::kEm);
  EXPECT_EQ(estimator.coefficient_count, 20);
  EXPECT_EQ(estimator.sigma_position_mm, 1.5);
  EXPECT_EQ(estimator.sigma_tangent, 0.25);
  EXPECT_EQ(estimator.sigma_strain_sqrt_mm, 0.5);
  EXPECT_EQ(estimator.bending_q_per_mm, 0.125);
  EXPECT_EQ(estimator.sigma_image_px, 2.5);
  EXPECT_EQ(estimator.image_search_px, 9);
  EXPECT_EQ(estimator.image_likelihood, ImageLikelihoodForm::kPosterior);
  EXPECT_EQ(estimator.image_temper, 3);
  EXPECT_EQ(estimator.em_stale_ms, 210);
  EXPECT_EQ(estimator.em_stuck_ms, 220);
  EXPECT_EQ(configuration.pipeline.em_stale_ms, 210);
  EXPECT_EQ(configuration.pipeline.image_stale_ms, 230);
  EXPECT_EQ(estimator.iterations, 5);
  EXPECT_EQ(configuration.frangi.scales_px, (std::vector<double>{2, 4}));
  EXPECT_EQ(configuration.frangi.beta, 0.75);
  EXPECT_EQ(configuration.frangi.structureness, 12);
  EXPECT_EQ(configuration.frangi.polarity, PolaritySetting::kBright);
  EXPECT_EQ(configuration.frangi.smoothing, FrangiSmoothing::kInteger16);
  EXPECT_EQ(configuration.frangi.area, FrangiArea::kFrame);
}

TEST(Assemble, WhatIsNotSaidOfFrangiIsAsTheSettingsBegin) {
  const FrangiSettings defaults;
  const FrangiSettings settings = parse_configuration(base(), "room.toml").frangi;

  EXPECT_EQ(settings.polarity, defaults.polarity);
  EXPECT_EQ(settings.smoothing, defaults.smoothing);
  EXPECT_EQ(settings.area, defaults.area);
}

TEST(Assemble, ACamerasWhiteLevelIsLearntUnlessItIsGiven) {
  EXPECT_EQ(parse_configuration(base(), "room.toml").room.cameras.at(0).white_level, 0);
  EXPECT_EQ(parse_configuration(base_with("fx = 2000.0", "fx = 2000.0\nwhite_level = 4095"), "room.toml")
                .room.cameras.at(0)
                .white_level,
            4095);
}

TEST(Assemble, MasksAreRectanglesInsideTheImage) {
  const auto with_masks = [](const std::string& masks) {
    return parse_configuration(base_with("fx = 2000.0", "fx = 2000.0\nmasks = " + masks), "room.toml")
        .room.cameras.at(0)
        .masks;
  };
  EXPECT_TRUE(parse_configuration(base(), "room.toml").room.cameras.at(0).masks.empty());
  EXPECT_EQ(with_masks("[0, 0, 160, 24, 300, 0, 100, 24]"),
            (std::vector<int>{0, 0, 160, 24, 300, 0, 100, 24}));
  const auto message_of = [&](const std::string& masks) -> std::string {
    try {
      with_masks(masks);
      return "";
    } catch (const ConfigurationError& error) {
      return error.what();
    }
  };
  EXPECT_NE(message_of("[0, 0, 160]").find("four numbers for each mask"), std::string::npos)
      << message_of("[0, 0, 160]");
  EXPECT_NE(
      message_of("[300, 0, 101, 24]").find("mask 1: expected a rectangle inside the image of 400 x 600"),
      std::string::npos)
      << message_of("[300, 0, 101, 24]");
}

TEST(Assemble, MarksAreTwoOrMoreFromTheTipOn) {
  const auto with_marks = [](const std::string& marks) {
    return base_with("length_mm = 380.0", "length_mm = 380.0\nmarks_mm = " + marks);
  };
  const InstrumentDescription instrument =
      parse_configuration(with_marks("[6.5, 10.5]\nmark_length_mm = 2.0"), "room.toml")
          .room.instruments.at(0);
  EXPECT_EQ(instrument.marks_mm, (std::vector<double>{6.5, 10.5}));
  EXPECT_EQ(instrument.mark_length_mm, 2);
  EXPECT_NE(complaint(with_marks("[6.5]")).find("expected two marks or more"), std::string::npos);
  EXPECT_NE(complaint(with_marks("[6.5, 7.0]")).find("at least mark_length_mm, 1.3 mm, apart"),
            std::string::npos)
      << complaint(with_marks("[6.5, 7.0]"));
  EXPECT_NE(complaint(with_marks("[6.5, 400.0]")).find("mm of the instrument behind its last mark"),
            std::string::npos);
}

TEST(Assemble, EveryKeyOfThePaperReachesItsField) {
  std::string text = base();
  text +=
      "[estimator.paper]\nknot_point_count = 12\nweights = \"printed\"\nsigma_length_mm = 0.75\n"
      "depth_lengths = \"printed\"\nmle_start = \"em\"\nmle_prior = \"none\"\nheaviside = "
      "\"narrowing\"\nhub_end = \"capped\"\n"
      "heaviside_px = 3.5\nappearance_share = 0.25\nrounds = 7\n";
  text.replace(text.find("mode = \"joint\""), 14, "mode = \"paper\"");

  const EstimatorSettings estimator = parse_configuration(text, "room.toml").estimators.at(0);

  EXPECT_EQ(estimator.mode, EstimatorMode::kPaper);
  EXPECT_EQ(estimator.paper.knot_point_count, 12);
  EXPECT_EQ(estimator.paper.weights, PaperWeights::kPrinted);
  EXPECT_EQ(estimator.paper.sigma_length_mm, 0.75);
  EXPECT_EQ(estimator.paper.depth_lengths, PaperDepthLengths::kPrinted);
  EXPECT_EQ(estimator.paper.mle_start, PaperMleStart::kEm);
  EXPECT_EQ(estimator.paper.mle_prior, PaperMlePrior::kNone);
  EXPECT_EQ(estimator.paper.hub_end, PaperHubEnd::kCapped);
  EXPECT_EQ(estimator.paper.heaviside, PaperHeaviside::kNarrowing);
  EXPECT_EQ(estimator.paper.heaviside_px, 3.5);
  EXPECT_EQ(estimator.paper.appearance_share, 0.25);
  EXPECT_EQ(estimator.paper.rounds, 7);
}

TEST(Assemble, ACameraKeepsItsFourNumbersApart) {
  std::string text = base();
  replace(text, "fx = 2000.0\nfy = 2000.0\ncx = 200.0\ncy = 300.0",
          "fx = 2001\nfy = 2002\ncx = 203\ncy = 304");
  replace(text, "[0, 0, 0, 0, 0]", "[0.1, 0.2, 0.3, 0.4, 0.5]");

  const CameraCalibration camera = parse_configuration(text, "room.toml").room.cameras.at(0);

  EXPECT_EQ(camera.name, "A");
  EXPECT_EQ(camera.width, 400);
  EXPECT_EQ(camera.height, 600);
  EXPECT_EQ(camera.fx, 2001);
  EXPECT_EQ(camera.fy, 2002);
  EXPECT_EQ(camera.cx, 203);
  EXPECT_EQ(camera.cy, 304);
  EXPECT_EQ(camera.distortion, (std::array<double, 5>{0.1, 0.2, 0.3, 0.4, 0.5}));
}

TEST(Assemble, ARotationWithThreeDecimalsIsMadeOneAndWarnedOf) {
  const std::string exact = "T_world_em = [[1, 0, 0, 0], [0, 1, 0, 0]";

  const auto rounded = parse_configuration(
      base_with(exact, "T_world_em = [[0.707, -0.707, 0, 0], [0.707, 0.707, 0, 0]"), "room.toml");

  EXPECT_NEAR(rounded.room.T_world_em.linear().determinant(), 1, 1e-12);
  ASSERT_FALSE(rounded.warnings.empty());
  EXPECT_NE(rounded.warnings.back().find("em.T_world_em: its rotation is rounded"), std::string::npos)
      << rounded.warnings.back();
  EXPECT_NE(
      complaint(base_with(exact, "T_world_em = [[0.7, -0.7, 0, 0], [0.7, 0.7, 0, 0]")).find("four decimals"),
      std::string::npos);
}

TEST(Assemble, AResidualBelongsToARegistration) {
  const std::string residual = "registration_residual_mm = 1.81\n";

  const auto stated = parse_configuration(base_with("T_world_em", residual + "T_world_em"), "room.toml");
  const auto not_stated = parse_configuration(base(), "room.toml");

  EXPECT_EQ(stated.room.registration_residual_mm, 1.81);
  EXPECT_EQ(not_stated.room.registration_residual_mm, std::nullopt);
  EXPECT_NE(complaint(base_with("T_world_em", residual + "#")).find("em.registration_residual_mm"),
            std::string::npos);
}

TEST(Assemble, HowWellARegistrationIsKnownReachesTheRoom) {
  // 2 x 10^-6 rad^2 about z, 0.09 mm^2 along each axis, and the turn about z moves along x.
  const std::string quality =
      "registration_covariance = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2e-6, 3e-4, 0, 0, 0.09, 0, 0, 0.09, 0, "
      "0.09]\n"
      "registration_centre_mm = [10, 20, 30]\nregistration_date = \"2026-01-31 14:05\"\n";

  const RoomDescription room =
      parse_configuration(base_with("T_world_em", quality + "T_world_em"), "room.toml").room;
  const RoomDescription silent = parse_configuration(base(), "room.toml").room;

  ASSERT_TRUE(room.registration_quality);
  EXPECT_EQ(room.registration_quality->centre_world_mm, Eigen::Vector3d(10, 20, 30));
  EXPECT_EQ(room.registration_quality->covariance(2, 3), 3e-4);
  EXPECT_EQ(room.registration_quality->covariance(3, 2), 3e-4);
  EXPECT_EQ(room.registration_date, "2026-01-31 14:05");
  EXPECT_FALSE(silent.registration_quality);
}

TEST(Assemble, RealSourcesBesideInventedOnesAreAllowedAndSaid) {
  std::vector<DriverDescription> available = drivers();
  available.push_back(available.back());
  available.back().name = "grabber";
  available.back().origin = Origin::kDevice;
  const std::string text = base_with("driver = \"simulation\"\n\n[[instrument]]",
                                     "driver = \"grabber\"\ndevice = \"/dev/video0\"\n\n[[instrument]]");

  const Configuration configuration = parse_configuration(text, "room.toml", available);

  EXPECT_EQ(configuration.image_sources.at(0).device, "/dev/video0");
  ASSERT_EQ(configuration.warnings.size(), 1U);
  EXPECT_NE(configuration.warnings[0].find("room.toml:34:10: camera[0].driver: real images beside simulated"),
            std::string::npos)
      << configuration.warnings[0];
}

TEST(Assemble, AHookWhoseRollNobodyWillFindIsAllowedAndSaid) {
  const auto warnings_with = [](const std::string& mode) {
    return parse_configuration(base_with("diameter_mm = 2.33",
                                         "diameter_mm = 2.33\nrest_shape = \"hook\"\nhook_radius_mm = 8\n"
                                         "hook_length_mm = 14\nmode = \"" +
                                             mode + "\""),
                               "room.toml")
        .warnings;
  };
  EXPECT_TRUE(warnings_with("filter").empty());
  EXPECT_TRUE(warnings_with("joint").empty());
  ASSERT_EQ(warnings_with("em").size(), 1U);
  EXPECT_NE(warnings_with("em")[0].find("instrument[0].rest_shape: mode \"em\" takes every tip for straight"),
            std::string::npos)
      << warnings_with("em")[0];
  const Configuration arcs = parse_configuration(
      base_with("diameter_mm = 2.33",
                "diameter_mm = 2.33\nrest_shape = \"arcs\"\nrest_arcs_mm = [14, 8]\nmode = \"em\""),
      "room.toml");
  ASSERT_EQ(arcs.warnings.size(), 1U);
  EXPECT_EQ(arcs.warnings[0], warnings_with("em")[0]);
}

TEST(Assemble, ADriversTableNeedsItsRequiredKeysOnlyWhenASourceUsesIt) {
  const std::string unused = base() + "[replay]\nloop = true\n";
  std::string used = unused;
  replace(used, "driver = \"simulation\"\nreconnect", "driver = \"replay\"\nreconnect");

  EXPECT_EQ(complaint(unused), "");
  EXPECT_NE(complaint(used).find("room.toml:63:1: replay.folder: missing"), std::string::npos)
      << complaint(used);
}

TEST(Assemble, AFifthCameraIsOneTooMany) {
  std::string text = base();
  const std::string camera =
      text.substr(text.find("[[camera]]"), text.find("[[instrument]]") - text.find("[[camera]]"));
  for (const char* name : {"B", "C", "D", "E"}) {
    std::string another = camera;
    replace(another, "\"A\"", std::string("\"") + name + "\"");
    text += another;
  }

  EXPECT_NE(complaint(text).find("camera[4]: expected at most 4"), std::string::npos) << complaint(text);
}

TEST(Assemble, WhatAFileSaysCannotReachTheTerminalAsACommand) {
  const std::string said = complaint(base() + "\"\\u001b[2J\" = 1\n");
  EXPECT_NE(said.find("unknown key"), std::string::npos) << said;
  EXPECT_EQ(said.find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace tubed
