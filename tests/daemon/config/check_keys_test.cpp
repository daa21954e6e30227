#include "daemon/config/check_keys.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/config/load_configuration.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kNow_s = 1'795'422'981;

Configuration with_keys(const std::string& folder) {
  std::ifstream in(std::filesystem::path(TUBED_SOURCE_DIR) / "tests/daemon/config/base.toml");
  std::ostringstream text;
  text << in.rdbuf();
  std::string base = text.str();
  base.insert(base.find("domain = 0"), "security = \"" + folder + "\"\n");
  return parse_configuration(base, "/etc/tubed/room.toml");
}

TEST(CheckKeys, WithoutAFolderNothingIsAskedFor) { EXPECT_NO_THROW(check_keys(with_keys(""), kNow_s)); }

TEST(CheckKeys, ARelativeFolderIsBesideTheConfiguration) {
  EXPECT_EQ(with_keys("keys").dds.security, "/etc/tubed/keys");
  EXPECT_EQ(with_keys("/srv/keys").dds.security, "/srv/keys");
}

TEST(CheckKeys, AMissingFolderIsToldAtTheKeysPlaceInTheFile) {
  try {
    check_keys(with_keys("/nowhere/keys"), kNow_s);
    FAIL() << "missing keys were accepted";
  } catch (const ConfigurationError& error) {
    const std::string words = error.what();
    EXPECT_EQ(words.find("/etc/tubed/room.toml:14:12: dds.security: /nowhere/keys: "), 0U) << words;
    EXPECT_NE(words.find("tubectl keys make-room"), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace tubed
