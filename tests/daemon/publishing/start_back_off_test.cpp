#include "daemon/publishing/start_back_off.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

namespace tubed {
namespace {

using std::chrono::milliseconds;

class StartBackOffTest : public testing::Test {
 protected:
  StartBackOffTest() {
    std::string name = testing::TempDir() + "back-off-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~StartBackOffTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

TEST(BackOff, DoublesFromAFifthOfASecondToTwo) {
  EXPECT_EQ(back_off_after(0), milliseconds{0});
  EXPECT_EQ(back_off_after(1), milliseconds{200});
  EXPECT_EQ(back_off_after(2), milliseconds{400});
  EXPECT_EQ(back_off_after(4), milliseconds{1600});
  EXPECT_EQ(back_off_after(5), milliseconds{2000});
  EXPECT_EQ(back_off_after(4'000'000'000), milliseconds{2000});
}

TEST_F(StartBackOffTest, StartsThatPublishNothingAreCountedAcrossProcesses) {
  for (unsigned failed = 0; failed < 5; ++failed) EXPECT_EQ(StartBackOff(folder_).begin(), failed);
}

TEST_F(StartBackOffTest, AStartThatPublishedEndsTheCount) {
  for (int i = 0; i < 3; ++i) StartBackOff(folder_).begin();
  StartBackOff(folder_).succeed();
  EXPECT_EQ(StartBackOff(folder_).begin(), 0U);
}

TEST_F(StartBackOffTest, ADamagedCountIsNone) {
  for (const char* const words : {"", "many", "-1", "99999999999999999999"}) {
    std::ofstream(folder_ / "failed-starts") << words;
    EXPECT_EQ(StartBackOff(folder_).begin(), 0U) << words;
  }
}

TEST_F(StartBackOffTest, WithoutAServiceManagerOrItsFolderNothingIsCounted) {
  for (const std::filesystem::path& nowhere : {std::filesystem::path(), folder_ / "nosuch"}) {
    StartBackOff(nowhere).begin();
    EXPECT_EQ(StartBackOff(nowhere).begin(), 0U);
    StartBackOff(nowhere).succeed();
  }
}

}  // namespace
}  // namespace tubed
