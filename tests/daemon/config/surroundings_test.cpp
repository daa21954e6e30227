#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "daemon/config/load_configuration.hpp"

namespace tubed {
namespace {

std::string base() {
  std::ifstream file(TUBED_SOURCE_DIR "/tests/daemon/config/base.toml");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class SurroundingsTest : public testing::Test {
 protected:
  SurroundingsTest() {
    std::string name = testing::TempDir() + "surroundings-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~SurroundingsTest() override { std::filesystem::remove_all(folder_); }

  /// What load_configuration() says of base.toml with these lines behind it; empty: nothing.
  std::string said_of(const std::string& lines) {
    const std::filesystem::path file = folder_ / "tubed.toml";
    std::ofstream(file) << base() << lines;
    try {
      load_configuration(file);
      return "";
    } catch (const ConfigurationError& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
};

bool says(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST_F(SurroundingsTest, ASocketBesideTheConfigurationAndAGroupOfThisSystemAreTaken) {
  EXPECT_EQ(said_of("[shm]\nestimates_socket = \"e.sock\"\ngroup = \"root\"\n"), "");
}

TEST_F(SurroundingsTest, AGroupThatThisSystemDoesNotHaveIsNamedWithItsPlace) {
  const std::string said = said_of("[shm]\nestimates_socket = \"e.sock\"\ngroup = \"nosuchgroup\"\n");
  EXPECT_TRUE(says(said, ":9: shm.group: this system has no group 'nosuchgroup'")) << said;
}

TEST_F(SurroundingsTest, AFolderOfASocketThatIsMissingOrNoneIsNamed) {
  const std::string missing = said_of("[shm]\nestimates_socket = \"nosuch/e.sock\"\n");
  EXPECT_TRUE(says(missing, "shm.estimates_socket: folder '") && says(missing, "No such file or directory"))
      << missing;
  const std::string previews = said_of("[shm]\npreview_folder = \"nosuch\"\n");
  EXPECT_TRUE(says(previews, "shm.preview_folder: folder '") && says(previews, "No such file or directory"))
      << previews;
  const std::string none = said_of("[shm]\nestimates_socket = \"tubed.toml/e.sock\"\n");
  EXPECT_TRUE(says(none, "is no folder")) << none;
}

TEST_F(SurroundingsTest, APathTooLongForASocketIsRefusedAlsoWhenTheFolderMakesItSo) {
  const std::string said = said_of("[shm]\nestimates_socket = \"" + std::string(100, 'e') + "\"\n");
  EXPECT_TRUE(says(said, "shm.estimates_socket: expected a path of at most 107 bytes")) << said;
}

TEST_F(SurroundingsTest, ParsingLooksAtNoMachine) {
  EXPECT_NO_THROW(parse_configuration(
      base() + "[shm]\nestimates_socket = \"/nosuch/e.sock\"\ngroup = \"nosuchgroup\"\n", "tubed.toml"));
}

}  // namespace
}  // namespace tubed
