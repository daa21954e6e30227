#include "daemon/config/load_configuration.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/config/sample_configuration.hpp"
#include "daemon/config/schema.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

const fs::path kHere = fs::path(TUBED_SOURCE_DIR) / "tests/daemon/config";

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

const std::string& base() {
  static const std::string text = content_of(kHere / "base.toml");
  return text;
}

TEST(LoadConfiguration, AGoodFileBecomesWhatItSays) {
  const Configuration configuration = load_configuration(kHere / "base.toml");
  EXPECT_EQ(configuration.dds.partition, "room-1");
  EXPECT_EQ(configuration.pipeline.rate_hz, 30);
  ASSERT_EQ(configuration.room.cameras.size(), 1U);
  EXPECT_EQ(configuration.room.cameras[0].fx, 2000);
  EXPECT_EQ(configuration.room.cameras[0].T_camera_world.translation().z(), 1200);
  ASSERT_EQ(configuration.room.instruments.size(), 1U);
  EXPECT_EQ(configuration.room.instruments[0].coils[1].offset_from_tip_mm, 90);
  EXPECT_EQ(configuration.estimators[0].mode, EstimatorMode::kJoint);
  EXPECT_EQ(configuration.em_source.driver, "simulation");
  EXPECT_EQ(configuration.em_source.settings.get<double>("lambda_mm"), 4.0);
  EXPECT_TRUE(configuration.room.registered);
}

TEST(LoadConfiguration, WithoutARegistrationTheRoomIsNotRegistered) {
  std::string text = base();
  text.replace(text.find("T_world_em"), 10, "#");
  EXPECT_FALSE(parse_configuration(text, "base.toml").room.registered);
}

TEST(LoadConfiguration, AnInstrumentsOwnModeGoesBeforeTheCommonOne) {
  std::string text = base();
  text.replace(text.find("diameter_mm"), 0, "mode = \"em\"\n");
  EXPECT_EQ(parse_configuration(text, "base.toml").estimators[0].mode, EstimatorMode::kEm);
}

TEST(LoadConfiguration, ATipIsUnknownUnlessItIsSaidWhatItIsLike) {
  const auto instrument = [](const std::string& keys) {
    std::string text = base();
    text.replace(text.find("diameter_mm"), 0, keys);
    return parse_configuration(text, "base.toml").room.instruments[0];
  };
  EXPECT_EQ(instrument("").rest_shape, RestShape::kUnknown);
  EXPECT_EQ(instrument("rest_shape = \"straight\"\n").rest_shape, RestShape::kStraight);
  const InstrumentDescription hook =
      instrument("rest_shape = \"hook\"\nhook_radius_mm = 12\nhook_length_mm = 25.5\n");
  EXPECT_EQ(hook.rest_shape, RestShape::kHook);
  EXPECT_EQ(hook.hook_radius_mm, 12);
  EXPECT_EQ(hook.hook_length_mm, 25.5);
  EXPECT_EQ(hook.rest_curve(), RestCurve::hook(12, 25.5));
  const InstrumentDescription arcs =
      instrument("rest_shape = \"arcs\"\nrest_arcs_mm = [8, 0, 14, 8, 12, 0, 20, -25, 5, 0]\n");
  EXPECT_EQ(arcs.rest_shape, RestShape::kArcs);
  EXPECT_EQ(arcs.rest_curve(), (RestCurve{{{8, 0}, {14, 8}, {12, 0}, {20, -25}, {5, 0}}}));
  EXPECT_EQ(arcs.rest_curve().length_mm(), 54);
  EXPECT_EQ(instrument("").rest_curve(), RestCurve{});
}

TEST(LoadConfiguration, StiffnessIsOfPiecesFromTheTip) {
  std::string text = base();
  EXPECT_EQ(parse_configuration(text, "base.toml").room.instruments[0].stiffness_profile(),
            StiffnessProfile{});
  text.replace(text.find("diameter_mm"), 0, "stiffness = [20, 0.2, 60, 0.6]\n");
  EXPECT_EQ(parse_configuration(text, "base.toml").room.instruments[0].stiffness_profile(),
            (StiffnessProfile{{{20, 0.2}, {60, 0.6}}}));
}

TEST(LoadConfiguration, TheDigestIsTheSha256OfTheFile) {
  const fs::path file = fs::temp_directory_path() / "tubed-digest-test.toml";
  std::ofstream(file) << base();
  const std::string first = load_configuration(file).digest;
  EXPECT_EQ(first.size(), 64U);
  EXPECT_EQ(first, load_configuration(file).digest);
  std::ofstream(file, std::ios::app) << "# one more line\n";
  EXPECT_NE(first, load_configuration(file).digest);
  fs::remove(file);
}

std::string with_a_card(const std::string& keys) {
  std::string text = base();
  const std::string images = "[0, 0, 0, 1]]\ndriver = \"simulation\"";
  text.replace(text.find(images), images.size(),
               "[0, 0, 0, 1]]\ndriver = \"v4l2\"\ndevice = \"/dev/video0\"");
  return text + "\n[v4l2]\n" + keys;
}

TEST(LoadConfiguration, TheCameraIsThatOfThePicturesThatItsDriverDelivers) {
  const Configuration configuration =
      parse_configuration(with_a_card("decimation = 2\nrotate_deg = \"90\"\n"), "card.toml");

  const CameraCalibration& camera = configuration.room.cameras.at(0);
  EXPECT_EQ(camera.width, 300);
  EXPECT_EQ(camera.height, 200);
  EXPECT_EQ(camera.fx, 1000);
  EXPECT_DOUBLE_EQ(camera.cy, (200 - 0.5) / 2);
  EXPECT_EQ(configuration.image_sources.at(0).settings.get<std::vector<std::int64_t>>("size"),
            (std::vector<std::int64_t>{400, 600}));
}

TEST(LoadConfiguration, ACropBeyondTheCardsPictureIsRefusedWithItsTablesPlace) {
  try {
    parse_configuration(with_a_card("crop = [300, 0, 101, 600]\n"), "card.toml");
    FAIL() << "was accepted";
  } catch (const ConfigurationError& error) {
    const std::string words = error.what();
    EXPECT_NE(words.find("camera[0] with [v4l2]"), std::string::npos) << words;
    EXPECT_NE(words.find("card.toml:65:1"), std::string::npos) << words;
    EXPECT_NE(words.find("expected a crop inside it"), std::string::npos) << words;
  }
}

TEST(LoadConfiguration, AFileThatIsNotThereIsSaidByName) {
  try {
    load_configuration("/no/such/tubed.toml");
    FAIL() << "was accepted";
  } catch (const ConfigurationError& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/tubed.toml"), std::string::npos);
  }
}

TEST(LoadConfiguration, AllThatIsWrongIsSaidAtOnce) {
  std::string text = base();
  text.replace(text.find("rate_hz = 30.0"), 14, "rate_hz = 0");
  text.replace(text.find("beta = 0.5"), 10, "betta = 0.5");
  try {
    parse_configuration(text, "base.toml");
    FAIL() << "was accepted";
  } catch (const ConfigurationError& error) {
    EXPECT_EQ(error.problems().size(), 2U) << error.what();
  }
}

TEST(LoadConfiguration, KnowsWhereEveryCoilOfAnAuroraIsPluggedIn) {
  std::string text = base();
  const auto replace = [&](const std::string& old, const std::string& with) {
    text.replace(text.find(old), old.size(), with);
  };
  replace("driver = \"simulation\"", "driver = \"aurora-serial\"\ndevice = \"/dev/ttyUSB0\"");
  replace("offset_from_tip_mm = 10.0", "offset_from_tip_mm = 10.0\nport = 3\nchannel = 1");
  replace("offset_from_tip_mm = 90.0", "offset_from_tip_mm = 90.0\nport = 3");
  const Configuration configuration = parse_configuration(text, "aurora.toml");
  const std::vector<CoilPlacement>& coils = configuration.room.instruments[0].coils;
  EXPECT_EQ(coils[0].port, 3);
  EXPECT_EQ(coils[0].channel, 1);
  EXPECT_EQ(coils[1].port, 3);
  EXPECT_EQ(coils[1].channel, 0);
  EXPECT_EQ(configuration.em_source.device, "/dev/ttyUSB0");
  EXPECT_NE(make_em_source(configuration), nullptr);
}

TEST(LoadConfiguration, KnowsWhichToolHasToBeInAPlug) {
  std::string text = base();
  const auto replace = [&](const std::string& old, const std::string& with) {
    text.replace(text.find(old), old.size(), with);
  };
  replace("driver = \"simulation\"", "driver = \"aurora-serial\"\ndevice = \"/dev/ttyUSB0\"");
  replace("offset_from_tip_mm = 10.0",
          "offset_from_tip_mm = 10.0\nport = 3\nchannel = 1\ntool_serial = \"3c4B0001\"");
  replace("offset_from_tip_mm = 90.0", "offset_from_tip_mm = 90.0\nport = 3\ntool_part_number = \"610029\"");
  const Configuration configuration = parse_configuration(text, "aurora.toml");
  const std::vector<CoilPlacement>& coils = configuration.room.instruments[0].coils;
  EXPECT_EQ(coils[0].tool_serial, 0x3C4B0001U);
  EXPECT_EQ(coils[0].tool_part_number, "");
  EXPECT_EQ(coils[1].tool_serial, std::nullopt);
  EXPECT_EQ(coils[1].tool_part_number, "610029");
}

TEST(LoadConfiguration, RefusesAToolSerialThatIsNoneOrHasNoPort) {
  for (const auto& [keys, words] : {std::pair{"port = 1\ntool_serial = \"3C4B000G\"", "hexadecimal digits"},
                                    std::pair{"tool_serial = \"3C4B0001\"", "means nothing without port"}}) {
    std::string text = base();
    const std::string first = "offset_from_tip_mm = 10.0";
    text.replace(text.find(first), first.size(), first + "\n" + keys);
    try {
      parse_configuration(text, "aurora.toml");
      FAIL() << "was accepted: " << keys;
    } catch (const ConfigurationError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

TEST(LoadConfiguration, RefusesASensorThatIsAtTwoPorts) {
  std::string text = base();
  const std::string first = "offset_from_tip_mm = 10.0";
  text.replace(text.find(first), first.size(), first + "\nport = 1");
  text.replace(text.find("[estimator]"), 0,
               "[[instrument]]\nid = \"cath-2\"\n[[instrument.coil]]\nsensor = 1\noffset_from_tip_mm = "
               "5.0\nport = 2\n\n");
  try {
    parse_configuration(text, "aurora.toml");
    FAIL() << "was accepted";
  } catch (const ConfigurationError& error) {
    EXPECT_NE(
        std::string(error.what()).find("instrument[1].coil[0].port: sensor 1 is at port 1 channel 0 already"),
        std::string::npos)
        << error.what();
  }
}

TEST(SampleConfiguration, IsTheFileThatTheBuildWrites) {
  EXPECT_EQ(content_of(TUBED_SAMPLE_FILE), sample_configuration());
}

TEST(SampleConfiguration, LoadsAndHasTheDefaultsOfTheSchema) {
  const Configuration configuration = parse_configuration(sample_configuration(), "tubed.toml");
  EXPECT_EQ(configuration.room.instruments[0].coils.size(), 5U);
  EXPECT_EQ(configuration.estimators[0].sigma_position_mm, EstimatorSettings{}.sigma_position_mm);
  EXPECT_EQ(configuration.pipeline.tick_grace_ms, PipelineSettings{}.tick_grace_ms);
}

void expect_all_keys(const TableDescription& table, const std::string& sample) {
  for (const KeyDescription& key : table.keys) {
    const bool given = sample.find("\n" + key.name + " = ") != std::string::npos;
    const bool as_comment = sample.find("\n# " + key.name + " = ") != std::string::npos;
    EXPECT_TRUE(given || as_comment) << table.name << "." << key.name;
    EXPECT_NE(sample.find("# " + key.meaning), std::string::npos) << table.name << "." << key.name;
  }
  for (const TableDescription& inner : table.tables) {
    expect_all_keys(inner, sample);
  }
}

TEST(SampleConfiguration, ExplainsEveryKeyOfTheSchema) {
  expect_all_keys(configuration_schema(drivers()), sample_configuration());
}

TEST(ConfigurationSchema, TheLogLevelAndHowCamerasStandTakeEffectWithoutARestart) {
  const TableDescription file = configuration_schema(drivers());

  EXPECT_TRUE(takes_effect_at_once(file, "daemon.log_level"));
  EXPECT_FALSE(takes_effect_at_once(file, "daemon.rate_hz"));
  EXPECT_TRUE(takes_effect_at_once(file, "camera[1].T_camera_world"));
  EXPECT_FALSE(takes_effect_at_once(file, "camera[1].width"));
  EXPECT_FALSE(takes_effect_at_once(file, "log_level"));
  EXPECT_FALSE(takes_effect_at_once(file, "simulation.lamda_mm"));
}

struct BadCase {
  std::string find, replace, position, key, word;
};

std::string unescaped(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_escape = text[i] == '\\' && i + 1 < text.size();
    plain += !is_escape ? text[i] : (text[i + 1] == 'n' ? '\n' : (text[i + 1] == 't' ? '\t' : text[i + 1]));
    i += is_escape ? 1 : 0;
  }
  return plain;
}

std::vector<BadCase> bad_cases() {
  std::vector<BadCase> cases;
  std::ifstream file(kHere / "bad_configurations.tsv");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') {
      continue;
    }
    std::istringstream fields(line);
    BadCase bad;
    std::getline(fields, bad.find, '\t');
    std::getline(fields, bad.replace, '\t');
    std::getline(fields, bad.position, '\t');
    std::getline(fields, bad.key, '\t');
    std::getline(fields, bad.word, '\t');
    bad.find = unescaped(bad.find);
    bad.replace = unescaped(bad.replace);
    cases.push_back(bad);
  }
  return cases;
}

TEST(BadConfigurations, ThereAreMoreThanAHundred) { EXPECT_GE(bad_cases().size(), 100U); }

TEST(BadConfigurations, TablesTooDeepInEachOtherAreRefusedWithTheirLineAndDoNotOverflowTheStack) {
  std::string dots;
  for (int i = 0; i < 400'000; ++i) {
    dots += ".a";
  }
  for (const std::string& deep : {"a" + dots + " = 1\n", "[a" + dots + "]\n", "[[a" + dots + "]]\n"}) {
    try {
      parse_configuration("# one\n" + deep, "deep.toml");
      FAIL() << "was accepted";
    } catch (const ConfigurationError& error) {
      EXPECT_NE(std::string(error.what()).find("deep.toml:2:1: "), std::string::npos);
      EXPECT_NE(std::string(error.what()).find("too deep"), std::string::npos);
    }
  }
}

TEST(BadConfigurations, ARestShapeWhoseNumberIsOutOfRangeIsNotCalledMissing) {
  for (const char* const hook :
       {"hook_radius_mm = -8\nhook_length_mm = 14\n", "hook_radius_mm = 8\nhook_length_mm = 900\n"}) {
    std::string text = base();
    text.replace(text.find("diameter_mm = 2.33\n"), 0, std::string("rest_shape = \"hook\"\n") + hook);
    try {
      parse_configuration(text, "hook.toml");
      FAIL() << "was accepted";
    } catch (const ConfigurationError& error) {
      const std::string words = error.what();
      EXPECT_NE(words.find("expected"), std::string::npos) << words;
      EXPECT_EQ(words.find("missing"), std::string::npos) << words;
    }
  }
}

TEST(BadConfigurations, DotsInCommentsAreNoDepth) {
  EXPECT_NO_THROW(parse_configuration("# " + std::string(10'000, '.') + "\n" + base(), "dots.toml"));
}

class BadConfiguration : public testing::TestWithParam<BadCase> {};

TEST_P(BadConfiguration, IsRefusedWithItsPlaceItsKeyAndWhatWasExpected) {
  const BadCase& bad = GetParam();
  std::string text = base();
  const std::size_t place = text.find(bad.find);
  ASSERT_NE(place, std::string::npos) << "base.toml has no " << bad.find;
  text.replace(place, bad.find.size(), bad.replace);
  try {
    parse_configuration(text, "bad.toml");
    FAIL() << "was accepted: " << bad.replace;
  } catch (const ConfigurationError& error) {
    const std::string line = "bad.toml:" + bad.position + ": " + (bad.key == "-" ? "" : bad.key + ":");
    const std::string said = error.what();
    const std::size_t found = said.find(line);
    ASSERT_NE(found, std::string::npos) << "expected " << line << "\nsaid " << said;
    if (bad.word != "-") {
      EXPECT_NE(said.find(bad.word, found + line.size()), std::string::npos)
          << "expected " << bad.word << "\nsaid " << said;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, BadConfiguration, testing::ValuesIn(bad_cases()),
                         [](const auto& which) { return "Number" + std::to_string(which.index + 1); });

TEST(LoadConfiguration, AFolderOrAFileWithoutEndIsNoConfiguration) {
  EXPECT_THROW(load_configuration("/"), ConfigurationError);
  EXPECT_THROW(load_configuration("/dev/zero"), ConfigurationError);
}

}  // namespace
}  // namespace tubed
