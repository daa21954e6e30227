#include "drivers/aurora_serial/tool_folder.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace tubed {
namespace {

namespace fs = std::filesystem;

class ToolFolderTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(folder); }
  void TearDown() override { fs::remove_all(folder); }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }
  std::string refusal() const {
    try {
      const ToolFolder tools(folder, "--tool-folder");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder = fs::temp_directory_path() / ("tool_folder_test." + std::to_string(::getpid()));
};

TEST_F(ToolFolderTest, HasTheToolsOfPorts1To16ByTheirFiles) {
  write("port-1.rom", "one");
  write("port-16.rom", std::string(1024, 'x'));
  write("port-17.rom", "no port of a tracker");
  write("port-2.txt", "no tool");
  const ToolFolder folder_tools(folder, "--tool-folder");
  const auto tools = folder_tools.tools();
  ASSERT_EQ(tools.size(), 2U);
  EXPECT_EQ(tools[0].port, 1);
  EXPECT_EQ(aurora::as_text(tools[0].bytes), "one");
  EXPECT_EQ(tools[1].port, 16);
  EXPECT_EQ(tools[1].bytes.size(), 1024U);
}

TEST_F(ToolFolderTest, HasNoneWithoutAFolder) {
  EXPECT_TRUE(ToolFolder("", "--tool-folder").tools().empty());
  EXPECT_TRUE(ToolFolder(folder / "nowhere", "--tool-folder").tools().empty());
}

TEST_F(ToolFolderTest, RefusesFilesThatAreNoToolAndNamesFileAndSetting) {
  write("port-3.rom", "");
  EXPECT_NE(refusal().find("port-3.rom"), std::string::npos);
  EXPECT_NE(refusal().find("see --tool-folder"), std::string::npos);
  write("port-3.rom", std::string(1025, 'x'));
  EXPECT_NE(refusal().find("1 to 1024 bytes"), std::string::npos);
  write("port-3.rom", "good");
  EXPECT_EQ(refusal(), "");
}

TEST_F(ToolFolderTest, AFileWithoutEndIsRefusedWithoutReadingItAll) {
  write("port-2.txt", "makes the folder");
  fs::create_symlink("/dev/zero", folder / "port-3.rom");
  EXPECT_NE(refusal().find("1 to 1024 bytes"), std::string::npos);
}

}  // namespace
}  // namespace tubed
