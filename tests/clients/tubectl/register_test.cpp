// tubectl register and tubectl pivot as a person uses them, and as a person misuses them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "clients/tubectl/calibrate/live_probe.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/sample_configuration.hpp"
#include "tests/clients/calibration/simulated_pivot.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"

namespace tubed {
namespace {

using Words = std::vector<std::string>;

/// Eight markers without symmetry, touched with an error of 0.2 mm along each axis.
struct Phantom {
  MarkerPairs pairs;

  Phantom() {
    std::mt19937 random(21);
    const SimulatedMarkers markers(random, 8, 0.2);
    pairs = markers.pairs;
  }
  static std::string csv(const Words& names, const Eigen::Matrix3Xd& points) {
    std::ostringstream text;
    text.precision(12);
    text << "name,x,y,z\n";
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Eigen::Vector3d p = points.col(static_cast<Eigen::Index>(i));
      text << names[i] << ',' << p.x() << ',' << p.y() << ',' << p.z() << '\n';
    }
    return text.str();
  }
  [[nodiscard]] std::string world() const { return csv(pairs.names, pairs.p_world_mm); }
  [[nodiscard]] std::string touched() const { return csv(pairs.names, pairs.p_em_mm); }
};

/// The same points with markers moved by what `change` does to both files.
template <typename Change>
Phantom changed(Change change) {
  Phantom phantom;
  change(phantom.pairs);
  return phantom;
}

class RegisterTest : public testing::Test {
 protected:
  struct Outcome {
    int exit_code = -1;
    std::string out;
    std::string words;  ///< both streams
  };

  static Outcome run(CommandLine (*add)(CommandLine, int&), Words arguments) {
    Outcome outcome;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    outcome.exit_code = run_verb(add, std::move(arguments));
    outcome.out = testing::internal::GetCapturedStdout();
    outcome.words = outcome.out + testing::internal::GetCapturedStderr();
    return outcome;
  }

  Outcome run_register(const std::string& world, const std::string& touched, Words further = {},
                       const std::string& suffix = ".csv") {
    Words arguments{"register", "--markers", folder_.write("world" + suffix, world), "--touched",
                    folder_.write("touched.csv", touched)};
    arguments.insert(arguments.end(), further.begin(), further.end());
    return run(add_register, arguments);
  }
  Outcome run_register(const Phantom& phantom, Words further = {}) {
    return run_register(phantom.world(), phantom.touched(), std::move(further));
  }
  Outcome run_pivot(const std::string& samples, Words further = {}) {
    Words arguments{"pivot", "--samples", folder_.write("probe.csv", samples)};
    arguments.insert(arguments.end(), further.begin(), further.end());
    return run(add_pivot, arguments);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_.path() + "/" + name; }

  StraightSequence folder_{1};
};

std::string text_of_file(const std::string& name) {
  std::ifstream stream(name);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

TEST_F(RegisterTest, MarkersGiveARegistrationAndAPage) {
  const Outcome outcome =
      run_register(Phantom(), {"--report", file("r.svg"), "--out", file("r.toml"), "--axes", "LPS"});

  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.words;
  for (const char* const key : {"T_world_em = ", "registration_residual_mm = ", "registration_covariance = ",
                                "registration_centre_mm = ", "registration_date = ", "world_axes = 'LPS'"}) {
    EXPECT_NE(text_of_file(file("r.toml")).find(key), std::string::npos) << key;
  }
  EXPECT_NE(text_of_file(file("r.svg")).find("Residuals"), std::string::npos);
}

TEST_F(RegisterTest, JsonDoesNotKeepARegistrationFromWhereItShallGo) {
  const std::string config = folder_.write("tubed.toml", sample_configuration({}));
  const Outcome outcome =
      run_register(Phantom(), {"--json", "-", "--out", file("j.toml"), "--config", config, "--yes"});

  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.words;
  EXPECT_TRUE(nlohmann::json::parse(outcome.out).contains("T_world_em"));
  EXPECT_NE(text_of_file(file("j.toml")).find("T_world_em = "), std::string::npos);
  EXPECT_NE(text_of_file(config).find("# found on "), std::string::npos);
}

TEST_F(RegisterTest, TheErrorIsExpectedAtTargetsAndAlongATube) {
  const auto report = nlohmann::json::parse(
      run_register(Phantom(),
                   {"--json", "-", "--targets", folder_.write("t.csv", "name,x,y,z\nheart,0,0,200\n"),
                    "--tube", folder_.write_estimates("e.csv", {0}, {0, 0, 0})})
          .out);

  EXPECT_EQ(report["targets"][0]["name"], "heart");
  EXPECT_GT(report["targets"][0]["tre_mm"], report["fle_mm"].get<double>() / std::sqrt(8));
  ASSERT_EQ(report["tube"].size(), 381);
  EXPECT_EQ(report["tube"][200]["tre_mm"], report["targets"][0]["tre_mm"]);  // s = 200 lies there
}

TEST_F(RegisterTest, MarkersInRasAreConvertedToLps) {
  const Phantom phantom;
  const auto lps = nlohmann::json::parse(run_register(phantom, {"--json", "-", "--axes", "LPS"}).out);
  Phantom ras = phantom;
  ras.pairs.p_world_mm.topRows<2>() *= -1;

  const auto converted = nlohmann::json::parse(run_register(ras, {"--json", "-", "--axes", "RAS"}).out);

  EXPECT_EQ(converted["world_axes"], "LPS");
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      EXPECT_NEAR(converted["T_world_em"][row][column], lps["T_world_em"][row][column], 1e-9);
    }
  }
}

TEST_F(RegisterTest, AnOutlierThatIsLeftOutNoLongerMatters) {
  const Phantom phantom = changed([](MarkerPairs& pairs) { pairs.p_em_mm.col(3).x() += 8; });

  EXPECT_EQ(run_register(phantom).exit_code, kExitBadData);
  EXPECT_EQ(run_register(phantom, {"--exclude", "M4"}).exit_code, kExitOk);
}

TEST_F(RegisterTest, OtherNamesArePairedByOrderWhenAskedFor) {
  Phantom phantom;
  const std::string world = phantom.world();
  for (std::string& name : phantom.pairs.names) name = "P" + name;

  EXPECT_EQ(run_register(world, phantom.touched()).exit_code, kExitBadData);
  EXPECT_EQ(run_register(world, phantom.touched(), {"--by-order"}).exit_code, kExitOk);
}

const std::string kMarkups =
    R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [)";

std::string many_markers(int count) {
  std::string text = "name,x,y,z\n";
  for (int i = 0; i < count; ++i) text += "P" + std::to_string(i) + "," + std::to_string(i) + ",0,0\n";
  return text;
}

TEST_F(RegisterTest, WhatIsUsedWrongIsMetWithWords) {
  const Phantom good;
  const auto swap = [](MarkerPairs& pairs) {
    const Eigen::Vector3d second = pairs.p_em_mm.col(1);
    pairs.p_em_mm.col(1) = pairs.p_em_mm.col(4);
    pairs.p_em_mm.col(4) = second;
  };
  const auto cycle = [](MarkerPairs& pairs) {
    const Eigen::Vector3d first = pairs.p_em_mm.col(0);
    pairs.p_em_mm.col(0) = pairs.p_em_mm.col(1);
    pairs.p_em_mm.col(1) = pairs.p_em_mm.col(2);
    pairs.p_em_mm.col(2) = first;
  };
  /// All markers on a line along world x but for so many mm across it.
  const auto line = [](double across_mm) {
    return [across_mm](MarkerPairs& pairs) {
      pairs.p_world_mm.bottomRows<2>() *= across_mm / 80;
      pairs.p_em_mm = pairs.p_world_mm + 0.001 * pairs.p_em_mm;
    };
  };
  const auto rename = [](MarkerPairs& pairs) {
    for (std::string& name : pairs.names) name += "a";
  };
  struct Misuse {
    const char* what;
    std::string world;
    std::string touched;
    Words further;
    std::string expected;
    std::string suffix = ".csv";
  };
  const auto of = [](const char* what, const Phantom& phantom, std::string expected, Words further = {}) {
    return Misuse{what, phantom.world(), phantom.touched(), std::move(further), std::move(expected)};
  };
  const std::vector<Misuse> misuses{
      of("two markers swapped", changed(swap), "M2 and M5 are exchanged"),
      of("three markers in a circle", changed(cycle), "what was touched as M1, M2 and M3 is M2, M3 and M1"),
      of("a left-handed file", changed([](MarkerPairs& pairs) { pairs.p_world_mm.row(0) *= -1; }),
         "left-handed coordinates"),
      of("the world in metres", changed([](MarkerPairs& pairs) { pairs.p_world_mm *= 1e-3; }),
         "are in metres"),
      of("the world in cm", changed([](MarkerPairs& pairs) { pairs.p_world_mm *= 0.1; }), "are in cm"),
      of("touched in inches", changed([](MarkerPairs& pairs) { pairs.p_em_mm /= 25.4; }),
         "touched markers are in inches"),
      of("another phantom", changed([](MarkerPairs& pairs) { pairs.p_em_mm *= 2; }), "not the same markers"),
      of("collinear markers", changed(line(0)), "lie on one line"),
      of("nearly collinear markers", changed(line(2)), "nearly on one line"),
      of("an outlier of 8 mm", changed([](MarkerPairs& pairs) { pairs.p_em_mm.col(3).x() += 8; }),
         "--exclude M4"),
      of("an excluded marker that is none", good, "has no such marker", {"--exclude", "M9"}),
      of("axes of the world asked for, those of the file not said", good, "say it with --axes",
         {"--world-axes", "RAS"}),
      {"two markers", "name,x,y,z\nM1,0,0,0\nM2,9,0,0\n", good.touched(), {}, "needs three markers"},
      {"names that do not match", good.world(), changed(rename).touched(), {}, "names do not match"},
      {"by order with other counts",
       good.world(),
       "name,x,y,z\nM1,0,0,0\n",
       {"--by-order"},
       "both need as many"},
      of("the world's markers given twice",
         changed([](MarkerPairs& pairs) { pairs.p_em_mm = pairs.p_world_mm; }), "has the places of"),
      of("the same, turned from LPS to RAS", changed([](MarkerPairs& pairs) {
           pairs.p_em_mm = pairs.p_world_mm;
           pairs.p_em_mm.topRows<2>() *= -1;
         }),
         "has the places of"),
      {"a surface instead of markers", many_markers(1001), good.touched(), {}, "1000 at most"},
      {"a name twice", "name,x,y,z\nM1,0,0,0\nM1,9,0,0\n", good.touched(), {}, "world.csv:3:1"},
      {"not a number", "name,x,y,z\nM1,0,nan,0\n", good.touched(), {}, "world.csv:2:6"},
      {"an empty file", "", good.touched(), {}, "the file is empty"},
      {"other columns", "marker;x;y;z\nM1;0;0;0\n", good.touched(), {}, "'name' is missing"},
      {"JSON that was cut off", kMarkups, good.touched(), {}, "this is no JSON", ".mrk.json"},
      {"JSON without markups", "{\"points\": []}", good.touched(), {}, "no \"markups\"", ".mrk.json"},
      {"fcsv without its axes",
       "id,1,2,3,0,0,0,1,1,1,0,M1\n",
       good.touched(),
       {},
       "CoordinateSystem",
       ".fcsv"},
  };
  for (const Misuse& misuse : misuses) {
    const Outcome outcome = run_register(misuse.world, misuse.touched, misuse.further, misuse.suffix);
    EXPECT_EQ(outcome.exit_code, kExitBadData) << misuse.what << '\n' << outcome.words;
    EXPECT_NE(outcome.words.find(misuse.expected), std::string::npos) << misuse.what << '\n' << outcome.words;
    EXPECT_EQ(outcome.out.find("T_world_em"), std::string::npos) << misuse.what;
  }
}

TEST_F(RegisterTest, ASymmetricSetIsRegisteredAndToldToBeAmbiguous) {
  const Phantom phantom = changed([](MarkerPairs& pairs) {
    // a rectangle: half a turn makes M1 M3 and M2 M4
    Eigen::Matrix3Xd corners(3, 4);
    corners << 0, 100, 100, 0, 0, 0, 60, 60, 0, 0, 0, 0;
    pairs.names.resize(4);
    pairs.p_world_mm = corners;
    pairs.p_em_mm =
        corners + 0.1 * corners.cwiseProduct(corners).unaryExpr([](double x) { return std::sin(x); });
  });

  const Outcome outcome = run_register(phantom);

  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.words;
  EXPECT_NE(outcome.words.find("nearly symmetric"), std::string::npos) << outcome.words;
}

TEST_F(RegisterTest, AnotherScaleIsTold) {
  const Outcome outcome = run_register(changed([](MarkerPairs& pairs) { pairs.p_world_mm *= 1.03; }));

  EXPECT_NE(outcome.words.find("look   scale"), std::string::npos) << outcome.words;
}

TEST_F(RegisterTest, ATipBesideTheAxisCannotBeUsedLive) {
  const Outcome outcome =
      run(add_register, {"register", "--markers", folder_.write("w.csv", Phantom().world()), "--live",
                         "--tip-offset", "1,0,98"});

  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.words.find("only 0,0,z"), std::string::npos) << outcome.words;
}

TEST_F(RegisterTest, AProbesTipIsFoundAndItsFileIsOneThatRegisterReads) {
  std::mt19937 random(1);
  const Outcome outcome =
      run_pivot(em_csv(PivotMovement{}.poses(random, ProbeFreedom::kFive)), {"--out", file("tip.toml")});

  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.words;
  EXPECT_NE(outcome.out.find("--tip-offset 0,0,9"), std::string::npos) << outcome.words;
  EXPECT_NE(text_of_file(file("tip.toml")).find("tip_offset_mm = [0.0000, 0.0000, 9"), std::string::npos);
}

TEST_F(RegisterTest, ATipFileThatIsNoneIsRefusedWithItsPlace) {
  const Words arguments{"register", "--markers", folder_.write("w.csv", Phantom().world()), "--live",
                        "--tip-offset-file"};
  for (const auto& [text, expected] : std::vector<std::pair<std::string, std::string>>{
           {"tip_offset_mm = [0, 0]\n", "tip.toml:1:17"},
           {"tip_offset_mm = [0, 0, nan]\n", "three finite numbers"},
           {"tip = 1\n", "tip_offset_mm is missing"},
           {"tip_offset_mm = [\n", "tip.toml:"}}) {
    Words with_file = arguments;
    with_file.push_back(folder_.write("tip.toml", text));
    const Outcome outcome = run(add_register, with_file);
    EXPECT_EQ(outcome.exit_code, kExitBadData);
    EXPECT_NE(outcome.words.find(expected), std::string::npos) << outcome.words;
  }
}

TEST_F(RegisterTest, AProbeThatIsTurnedWrongIsMetWithWords) {
  std::mt19937 random(2);
  const auto poses = [&](const PivotMovement& movement) {
    return movement.poses(random, ProbeFreedom::kFive);
  };
  auto lifted = poses({});
  for (std::size_t i = 0; i < 40; ++i) lifted[i].p_em_mm.z() += 20;
  auto slid = poses({});
  for (std::size_t i = 0; i < 180; ++i) slid[i].p_em_mm.z() += 20;
  auto unseen = em_csv(poses({.count = 40}));
  for (std::size_t at = 0; (at = unseen.find(",OK,", at)) != std::string::npos;)
    unseen.replace(at, 4, ",MISSING,");
  struct Misuse {
    const char* what;
    std::string samples;
    Words further;
    int exit_code;
    std::string expected;
  };
  const std::vector<Misuse> misuses{
      {"not turned", em_csv(poses({.lean_deg = 3})), {}, kExitBadData, "lean the probe 30 degrees"},
      {"lifted in between", em_csv(lifted), {}, kExitOk, "was the probe lifted?"},
      {"slid", em_csv(slid), {}, kExitBadData, "slid or was lifted"},
      {"too few", em_csv(poses({.count = 20})), {}, kExitBadData, "expected 30 at least"},
      {"too inexact", em_csv(poses({})), {"--max-sigma", "0.001"}, kExitBadData, "known to"},
      {"another sensor", em_csv(poses({})), {"--sensor", "4"}, kExitBadData, "there are rows of 1"},
      {"never seen", unseen, {}, kExitBadData, "is never OK"},
      {"5 DOF taken as 6", em_csv(poses({})), {"--dof", "6"}, kExitBadData, "use --dof 5"},
      {"no tangent",
       "em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz\n1,1,OK,1,2,3,0,0,0,1,0,0,0\n",
       {},
       kExitBadData,
       "probe.csv:2:14"},
      {"an empty file", "", {}, kExitBadData, "the file is empty"},
  };
  for (const Misuse& misuse : misuses) {
    const Outcome outcome = run_pivot(misuse.samples, misuse.further);
    EXPECT_EQ(outcome.exit_code, misuse.exit_code) << misuse.what << '\n' << outcome.words;
    EXPECT_NE(outcome.words.find(misuse.expected), std::string::npos) << misuse.what << '\n' << outcome.words;
  }
}

TEST(LiveProbe, ACoilOfAMeasurementIsAProbeWhoseAxisIsItsTangent) {
  tubed_EmSamples sample{};
  sample.coil_count = 2;
  sample.tracker_frame = 17;
  sample.coils[1] = {.status = 1, .p_em_mm = {1, 2, 3}, .tangent_em = {0, 0.6, 0.8}, .indicator = 0};

  const ProbePose pose = probe_pose(sample, 2);

  EXPECT_TRUE(pose.is_seen);
  EXPECT_EQ(pose.frame, 17U);
  EXPECT_EQ(pose.p_em_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(pose.axis_em().isApprox(Eigen::Vector3d(0, 0.6, 0.8), 1e-12));
  EXPECT_FALSE(probe_pose(sample, 1).is_seen);
  EXPECT_THROW(probe_pose(sample, 3), std::runtime_error);
}

}  // namespace
}  // namespace tubed
