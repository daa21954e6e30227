#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/config/load_configuration.hpp"

namespace tubed {
namespace {

std::string base() {
  std::ifstream in(std::filesystem::path(TUBED_SOURCE_DIR) / "tests/daemon/config/base.toml");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(ShmSettings, WithoutATableThereAreNoEstimatesInSharedMemory) {
  EXPECT_EQ(parse_configuration(base(), "/etc/tubed/room.toml").shm.estimates_socket, "");
}

TEST(ShmSettings, SocketAndGroupAreAsWritten) {
  const ShmSettings absolute =
      parse_configuration(base() + "[shm]\nestimates_socket = \"/run/tubed/e.sock\"\ngroup = \"video\"\n",
                          "/etc/tubed/room.toml")
          .shm;
  EXPECT_EQ(absolute.estimates_socket, "/run/tubed/e.sock");
  EXPECT_EQ(absolute.group, "video");
}

TEST(ShmSettings, ARelativeSocketIsBesideTheConfiguration) {
  EXPECT_EQ(parse_configuration(base() + "[shm]\nestimates_socket = \"e.sock\"\n", "/etc/tubed/room.toml")
                .shm.estimates_socket,
            "/etc/tubed/e.sock");
}

TEST(ShmSettings, APathTooLongForASocketIsRefused) {
  const std::string path(108, 'x');
  EXPECT_THROW(parse_configuration(base() + "[shm]\nestimates_socket = \"" + path + "\"\n", "room.toml"),
               ConfigurationError);
}

TEST(ShmSettings, TheDriverOfSharedImagesIsKnown) {
  std::string text = base();
  const std::string old = "driver = \"simulation\"\n\n[[instrument]]";
  text.replace(text.find(old), old.size(),
               "driver = \"image_shm\"\ndevice = \"/run/tubed/a.sock\"\n\n[[instrument]]");
  const Configuration configuration = parse_configuration(text, "room.toml");
  EXPECT_EQ(configuration.image_sources.at(0).driver, "image_shm");
  EXPECT_NE(make_image_source(configuration, 0), nullptr);
}

}  // namespace
}  // namespace tubed
