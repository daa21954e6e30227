// What the doctor makes of cards and of the sockets of grabbers.
#include "clients/tubectl/check/doctor_video.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "drivers/v4l2/v4l2_settings.hpp"
#include "tests/drivers/v4l2/fake_card.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

bool says(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

DriverSettings settings_with(const std::map<std::string, SettingValue>& changed) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& key : v4l2_settings()) {
    values.emplace(key.name, key.default_value);
  }
  for (const auto& [name, value] : changed) {
    values.insert_or_assign(name, value);
  }
  return DriverSettings(std::move(values));
}

class DoctorAtACard : public testing::Test {
 protected:
  CardOffer asked() {
    FakeVideoDevice device(card);
    return survey_card(device, "/dev/video0");
  }
  Finding found(const std::map<std::string, SettingValue>& settings = {}) {
    return camera_finding(asked(), settings_with(settings));
  }
  FakeCard card;
};

TEST_F(DoctorAtACard, NamesItsInputsFormatsSizesAndRates) {
  card.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_H264};
  card.input_status = V4L2_IN_ST_NO_SIGNAL;

  const std::string line = describe(asked());

  EXPECT_TRUE(says(line, "Fake Card (fakecard, )")) << line;
  EXPECT_TRUE(says(line, "input 0 , chosen, no signal")) << line;
  EXPECT_TRUE(says(line, "formats that are read: yuyv up to 96 x 64 at 30 Hz")) << line;
  EXPECT_FALSE(says(line, "H264")) << line;
}

TEST_F(DoctorAtACard, ANameWithControlCharactersForgesNoLine) {
  card.name = "a\n\x1b[2Jgood: x";
  const std::string line = describe(asked());
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_EQ(line.find('\x1b'), std::string::npos);
}

TEST_F(DoctorAtACard, ChangesNothing) {
  card.pix.width = 1;
  asked();
  EXPECT_EQ(card.pix.width, 1U);
  EXPECT_TRUE(card.buffers.empty());
}

TEST_F(DoctorAtACard, SaysWhatDoesNotFit) {
  using Numbers = std::vector<std::int64_t>;
  EXPECT_EQ(found().verdict, Verdict::kGood);
  EXPECT_EQ(found({{"size", Numbers{96, 64}}}).verdict, Verdict::kGood);
  EXPECT_TRUE(says(found({{"size", Numbers{640, 480}}}).found, "with 640 x 480 pixels"));
  EXPECT_TRUE(says(found({{"format", std::string("y16")}}).found, "does not offer y16"));
  EXPECT_TRUE(says(found({{"input", std::int64_t{4}}}).found, "has no input 4"));
  card.input_status = V4L2_IN_ST_NO_SIGNAL;
  EXPECT_TRUE(says(found().found, "no signal at input 0"));
  card.open_error = EACCES;
  EXPECT_TRUE(says(found().found, "usermod -aG video"));
  card.is_plugged = false;
  EXPECT_TRUE(says(found().found, "is not there"));
}

TEST(DoctorOfCards, ListsTheNodesOfAMachineAndWhoMayUseThem) {
  const TemporaryFolder folder;
  const std::filesystem::path root = folder.path();
  std::filesystem::create_directories(root / "dev");
  std::filesystem::create_directories(root / "etc");
  for (const char* name : {"video10", "video2", "videox"}) std::ofstream(root / "dev" / name) << "";
  std::ofstream(root / "etc/passwd") << "root:x:0:0::/:/bin/sh\ntubed:x:990:990::/:/bin/sh\n";
  std::ofstream(root / "etc/group") << "video:x:44:nottubed\n";
  Machine machine;
  machine.root = root;
  FakeCard card;
  const auto make = [&]() -> std::unique_ptr<VideoDevice> { return std::make_unique<FakeVideoDevice>(card); };

  const std::vector<NamedFinding> cards = examine_cards(machine, make);

  ASSERT_EQ(cards.size(), 3U);
  EXPECT_TRUE(cards[0].name.ends_with("/dev/video2"));
  EXPECT_TRUE(cards[1].name.ends_with("/dev/video10"));
  EXPECT_TRUE(says(cards[2].finding.found, "tubed is not in group video"));
  std::ofstream(root / "etc/group") << "video:x:44:anna,tubed\n";
  EXPECT_EQ(examine_cards(machine, make)[2].finding.verdict, Verdict::kGood);
}

}  // namespace
}  // namespace tubed
