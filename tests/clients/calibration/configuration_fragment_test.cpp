#include "clients/calibration/configuration_fragment.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <toml++/toml.h>

#include <fstream>
#include <sstream>

#include "daemon/config/sample_configuration.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

constexpr const char* kConfiguration = R"(# a room
[em]
driver = "aurora-serial"   # the tracker
T_world_em = [[1, 0, 0, 0],
              [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]  # by eye

[[camera]]
name = "A"
driver = "image-shm"
fx = 2000.0
[camera.image-shm]
socket = "a.sock"

[[camera]]
name = "über"
fx = 1500.0

[[instrument]]
id = "cath-1"
[[instrument.coil]]
offset_from_tip_mm = 8.0
[[instrument.coil]]
offset_from_tip_mm = 94.0
)";

ConfigurationFragment fragment_of(std::vector<FoundValue> values) {
  return {"tubectl register, 13 markers", "2026-11-24 14:05", {"RMS 1.8 mm"}, std::move(values)};
}

Eigen::Matrix4d shifted(double x_mm) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T(0, 3) = x_mm;
  return T;
}

std::string accepted(std::vector<FoundValue> values) {
  return accept(kConfiguration, "tubed.toml", fragment_of(std::move(values))).text;
}

std::string refusal(std::vector<FoundValue> values, const std::string& text = kConfiguration) {
  try {
    accept(text, "tubed.toml", fragment_of(std::move(values)));
  } catch (const FragmentError& error) {
    return error.what();
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(ConfigurationFragment, ReadsAsTomlWithWhoFoundItWhenAndHowWell) {
  const std::string text =
      to_toml(fragment_of({{"em.T_world_em", shifted(2.5)}, {"em.registration_residual_mm", 1.81}}));

  EXPECT_EQ(text,
            "# found on 2026-11-24 14:05 by tubectl register, 13 markers\n# RMS 1.8 mm\n\n[em]\n"
            "T_world_em = [[1.0, 0.0, 0.0, 2.5],\n              [0.0, 1.0, 0.0, 0.0],\n"
            "              [0.0, 0.0, 1.0, 0.0],\n              [0.0, 0.0, 0.0, 1.0]]\n"
            "registration_residual_mm = 1.81\n");
  EXPECT_EQ(toml::parse(text)["em"]["T_world_em"][0][3].value<double>(), 2.5);
}

TEST(ConfigurationFragment, NamesElementsOfListsByTheirNames) {
  const std::string text = to_toml(fragment_of({{"camera[A].fx", 2010.5},
                                                {"instrument[cath-1].coil[2].offset_from_tip_mm", 93.2},
                                                {"camera[A].c_arm.zoom", 1.5},
                                                {"camera[A].fy", 2011.0}}));
  const toml::table parsed = toml::parse(text);

  EXPECT_EQ(parsed["camera"][0]["name"].value<std::string>(), "A");
  EXPECT_EQ(parsed["camera"][0]["fy"].value<double>(), 2011.0);
  EXPECT_EQ(parsed["instrument"][0]["id"].value<std::string>(), "cath-1");
  EXPECT_EQ(parsed["instrument"][0]["coil"][0]["offset_from_tip_mm"].value<double>(), 93.2);
}

TEST(ConfigurationFragment, AnElementIsOpenedOnceHoweverItsValuesAreOrdered) {
  const toml::table parsed =
      toml::parse(to_toml(fragment_of({{"camera[A].c_arm.zoom", 1.5},
                                       {"em.registration_residual_mm", 1.0},
                                       {"camera[A].cx", 257.3},
                                       {"instrument[cath-1].coil[1].offset_from_tip_mm", 8.0},
                                       {"camera[A].cy", 253.9}})));

  ASSERT_EQ(parsed["camera"].as_array()->size(), 1U);
  EXPECT_EQ(parsed["camera"][0]["cx"].value<double>(), 257.3);
  EXPECT_EQ(parsed["camera"][0]["cy"].value<double>(), 253.9);
  EXPECT_EQ(parsed["camera"][0]["c_arm"]["zoom"].value<double>(), 1.5);
}

TEST(ConfigurationFragment, TextsCannotEndACommentOrAString) {
  ConfigurationFragment fragment = fragment_of({{"em.registration_date", std::string("a\"b\n[evil]")}});
  fragment.remarks = {"marker \"x\"\n[evil]\nkey = 1"};

  const toml::table parsed = toml::parse(to_toml(fragment));

  EXPECT_EQ(parsed.size(), 1U);
  EXPECT_EQ(parsed["em"]["registration_date"].value<std::string>(), "a\"b\n[evil]");
}

TEST(ConfigurationFragment, AValueChangesWhereItStandsAndNothingElseDoes) {
  const std::string expected = replaced(
      kConfiguration,
      "T_world_em = [[1, 0, 0, 0],\n              [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]  # by eye\n",
      "# found on 2026-11-24 14:05 by tubectl register, 13 markers\n"
      "T_world_em = [[1.0, 0.0, 0.0, 7.0],\n              [0.0, 1.0, 0.0, 0.0],\n              [0.0, 0.0, "
      "1.0, 0.0],\n"
      "              [0.0, 0.0, 0.0, 1.0]]  # by eye\n");

  EXPECT_EQ(accepted({{"em.T_world_em", shifted(7)}}), expected);
}

TEST(ConfigurationFragment, ANewKeyGoesToTheEndOfItsTable) {
  const std::string comment = "# found on 2026-11-24 14:05 by tubectl register, 13 markers\n";

  EXPECT_EQ(accepted({{"camera[A].focal_sigma", 0.01}}),
            replaced(kConfiguration, "fx = 2000.0\n", "fx = 2000.0\n" + comment + "focal_sigma = 0.01\n"));
  EXPECT_EQ(accepted({{"instrument[cath-1].coil[2].offset_sigma_mm", 0.4}}),
            kConfiguration + comment + "offset_sigma_mm = 0.4\n");
  EXPECT_EQ(accepted({{"camera[über].fx", 1510.0}}),
            replaced(kConfiguration, "fx = 1500.0\n", comment + "fx = 1510.0\n"));
}

TEST(ConfigurationFragment, ATableThatIsNotThereIsAdded) {
  const std::string text = accepted({{"camera[A].c_arm.zoom", 1.5}, {"estimator.sigma_tangent", 0.02}});
  const toml::table parsed = toml::parse(text);

  EXPECT_EQ(parsed["camera"][0]["c_arm"]["zoom"].value<double>(), 1.5);
  EXPECT_EQ(parsed["camera"][0]["image-shm"]["socket"].value<std::string>(), "a.sock");
  EXPECT_FALSE(parsed["camera"][1]["c_arm"]);
  EXPECT_EQ(parsed["estimator"]["sigma_tangent"].value<double>(), 0.02);
}

TEST(ConfigurationFragment, ATableThatOnlyItsInnerOneMadeGetsAHeader) {
  const auto text = accept("[em.reference]\nsensors = [7]\n", "tubed.toml",
                           fragment_of({{"em.registration_residual_mm", 1.0}}))
                        .text;
  const toml::table parsed = toml::parse(text);

  EXPECT_EQ(parsed["em"]["registration_residual_mm"].value<double>(), 1.0);
  EXPECT_FALSE(parsed["em"]["reference"]["registration_residual_mm"]);
}

TEST(ConfigurationFragment, AcceptedTwiceItChangesNothingMore) {
  const ConfigurationFragment fragment =
      fragment_of({{"em.T_world_em", shifted(7)}, {"em.registration_residual_mm", 1.8}});
  const std::string once = accept(kConfiguration, "tubed.toml", fragment).text;
  const AcceptedFragment twice = accept(once, "tubed.toml", fragment);

  EXPECT_EQ(twice.text, once);
  EXPECT_TRUE(twice.changes.empty());
}

TEST(ConfigurationFragment, ALaterCalibrationReplacesTheCommentOfTheEarlierOne) {
  const std::string once = accept(kConfiguration, "tubed.toml", fragment_of({{"camera[A].fx", 2010.0}})).text;
  ConfigurationFragment later = fragment_of({{"camera[A].fx", 2020.0}});
  later.date = "2027-01-02 08:00";

  const std::string text = accept(once, "tubed.toml", later).text;

  EXPECT_EQ(text.find("2026-11-24"), std::string::npos);
  EXPECT_NE(text.find("# found on 2027-01-02 08:00 by tubectl register, 13 markers\nfx = 2020.0\n"),
            std::string::npos);
}

TEST(ConfigurationFragment, AFileWithoutALastLineBreakAndOneOfWindowsAreUnderstood) {
  const auto without =
      accept("[em]\ndriver = \"x\"", "tubed.toml", fragment_of({{"em.registration_residual_mm", 1.0}}));
  EXPECT_EQ(toml::parse(without.text)["em"]["registration_residual_mm"].value<double>(), 1.0);

  const auto windows = accept("[em]\r\nfx = 1.0\r\nb = 2\r\n", "tubed.toml", fragment_of({{"em.fx", 3.0}}));
  EXPECT_EQ(toml::parse(windows.text)["em"]["fx"].value<double>(), 3.0);
  EXPECT_EQ(toml::parse(windows.text)["em"]["b"].value<int>(), 2);
}

TEST(ConfigurationFragment, SaysWhatChangesFromWhatToWhat) {
  const auto changes =
      accept(kConfiguration, "tubed.toml",
             fragment_of({{"camera[A].fx", 2000.0}, {"camera[A].fy", 2011.0}, {"camera[über].fx", 1400.0}}))
          .changes;

  ASSERT_EQ(changes.size(), 2U);  // fx of A is as it was
  EXPECT_EQ(changes[0].path + changes[0].before + changes[0].after, "camera[A].fy2011.0");
  EXPECT_EQ(changes[1].path + " " + changes[1].before + " " + changes[1].after,
            "camera[über].fx 1500.0 1400.0");
}

TEST(ConfigurationFragment, WhatTheFileDoesNotHaveIsNamedWithWhatItHas) {
  EXPECT_EQ(refusal({{"camera[C].fx", 1.0}}), "tubed.toml: has no [[camera]] 'C'; it has A or über");
  EXPECT_EQ(refusal({{"instrument[cath-1].coil[3].offset_from_tip_mm", 1.0}}),
            "tubed.toml: has no [[coil]] '3'; it has 1 or 2");
  EXPECT_EQ(refusal({{"phantom[1].x", 1.0}}), "tubed.toml: has no [[phantom]] '1'");
}

TEST(ConfigurationFragment, RefusesWhatCannotBePutInWithoutGuessing) {
  EXPECT_NE(refusal({{"camera[A].fx", 1.0}}, "x = [\n").find("tubed.toml:"), std::string::npos);
  EXPECT_NE(
      refusal({{"em.b", 1.0}}, "em = { a = 1 }\n").find("written in braces: write b = 1.0 there yourself"),
      std::string::npos);
  EXPECT_NE(refusal({{"camera[A].fx", 1.0}}, "[[camera]]\nname = \"A\"\n[camera.c_arm]\nzoom = 1.0\n")
                .find("[camera.c_arm]"),
            std::string::npos);
  for (const char* const path : {"fx", ".fx", "camera[].fx", "camera[A.fx", "a..b", "a.b[1]"}) {
    EXPECT_NE(refusal({{path, 1.0}}), "accepted") << path;
  }
}

TEST(ConfigurationFragment, WhatAFoundCArmReplacesIsCommentedOut) {
  const std::string text =
      "[[camera]]\nname = \"A\"\nT_camera_world = [[1, 0, 0, 0],\n  [0, 1, 0, 0], # y\n  [0, 0, 1, 1200], "
      "[0, 0, 0, 1]] # by eye\nfx = 2000.0\r\ncx = 200.0\n[[camera]]\nname = \"B\"\nfx = 9.0";
  const AcceptedFragment accepted =
      accept(text, "tubed.toml", fragment_of({{"camera[A].c_arm.zoom", 1.5}, {"camera[A].cx", 201.0}}));

  EXPECT_NE(
      accepted.text.find("# T_camera_world = [[1, 0, 0, 0],  # replaced by c_arm\n#   [0, 1, 0, 0], # y\n"
                         "#   [0, 0, 1, 1200], [0, 0, 0, 1]] # by eye\n"
                         "# fx = 2000.0  # replaced by c_arm\r\n"),
      std::string::npos)
      << accepted.text;
  const toml::table parsed = toml::parse(accepted.text);
  EXPECT_FALSE(parsed["camera"][0]["fx"] || parsed["camera"][0]["T_camera_world"]);
  EXPECT_EQ(parsed["camera"][0]["cx"].value<double>(), 201.0);
  EXPECT_EQ(parsed["camera"][0]["c_arm"]["zoom"].value<double>(), 1.5);
  EXPECT_EQ(parsed["camera"][1]["fx"].value<double>(), 9.0);
  ASSERT_EQ(accepted.changes.size(), 4U);
  EXPECT_EQ(accepted.changes[2].path + accepted.changes[2].before + accepted.changes[2].replaced_by,
            "camera[A].fx2000.0[camera.c_arm]");
  EXPECT_EQ(accepted.changes[3].path, "camera[A].T_camera_world");
}

TEST(ConfigurationFragment, WhatALastCameraLosesNeedsNoLastLineBreak) {
  const std::string text = accept("[[camera]]\n[camera.c_arm]\nzoom = 1.0\n[[camera]]\nfx = 9.0",
                                  "tubed.toml", fragment_of({{"camera[2].c_arm.zoom", 2.0}}))
                               .text;

  EXPECT_FALSE(toml::parse(text)["camera"][1]["fx"]) << text;
  EXPECT_EQ(toml::parse(text)["camera"][1]["c_arm"]["zoom"].value<double>(), 2.0) << text;
}

TEST(ConfigurationFragment, ACArmIsAcceptedIntoTheSampleConfiguration) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "tubed.toml";
  std::ofstream(file) << sample_configuration({});

  const AcceptedFragment accepted =
      accept_into(file, fragment_of({{"camera[A].c_arm.source_detector_mm", 1100.0},
                                     {"camera[A].c_arm.source_isocentre_mm", 750.0},
                                     {"camera[A].c_arm.pixel_pitch_mm", 0.2}}));

  EXPECT_NE(accepted.text.find("\n# fx = 2000.0  # replaced by c_arm\n"), std::string::npos);
  EXPECT_EQ(accepted.changes.size(), 6U);
}

TEST(ConfigurationFragment, TheLinesOfACArmThatMakesAFoundValueAreNamed) {
  EXPECT_EQ(
      refusal({{"camera[A].T_camera_world", shifted(1)}},
              "[[camera]]\nname = \"A\"\n[camera.c_arm]\nzoom = 1.0\ntable_mm = [0,\n0, 0]\n[em]\na = 1\n"),
      "tubed.toml:3: T_camera_world follows from [camera.c_arm] there: comment out lines 3 to 6 first, or "
      "calibrate the C-arm");
}

TEST(ConfigurationFragment, AResultThatWouldBeNoConfigurationIsRefusedInItsWords) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "tubed.toml";
  std::ofstream(file) << kConfiguration;

  try {
    accept_into(file, fragment_of({{"em.T_world_em", Eigen::Matrix4d(2 * Eigen::Matrix4d::Identity())}}));
    FAIL() << "it was accepted";
  } catch (const FragmentError& error) {
    EXPECT_NE(std::string(error.what()).find("em.T_world_em: expected a rigid transform"), std::string::npos)
        << error.what();
  }
}

TEST(ConfigurationFragment, AFileIsReplacedInOneStepKeepsItsPermissionsAndItsPast) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "tubed.toml";
  std::ofstream(file) << "old";
  ASSERT_EQ(::chmod(file.c_str(), 0640), 0);

  const auto copy = replace_configuration(file, "new");

  const auto content = [](const std::filesystem::path& of) {
    std::ostringstream text;
    text << std::ifstream(of).rdbuf();
    return text.str();
  };
  struct stat about {};
  EXPECT_EQ(::stat(file.c_str(), &about), 0);
  EXPECT_EQ(content(file), "new");
  EXPECT_EQ(content(copy), "old");
  EXPECT_EQ(about.st_mode & 07777U, 0640U);
  EXPECT_THROW(replace_configuration(folder.path() / "none.toml", "x"), FragmentError);
}

}  // namespace
}  // namespace tubed
