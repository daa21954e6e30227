#include "clients/tubectl/check/tracker_findings.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

bool says(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

TEST(TrackerFindings, BinaryRepliesAreGood) {
  EXPECT_EQ(reply_finding(ReplyForm::kBinary, {}, {}).verdict, Verdict::kGood);
}

TEST(TrackerFindings, ATrackerThatRefusesBxIsNotSlowedDown) {
  TrackerStartup startup;
  startup.errors[{"BX", 0x01}] = 3;
  const Finding finding = reply_finding(ReplyForm::kText, {}, startup);
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_TRUE(says(finding.found, "the tracker refuses BX: ERROR01 to BX (3 times)")) << finding.found;
  EXPECT_TRUE(says(finding.advice, "230400")) << finding.advice;
  EXPECT_FALSE(says(finding.advice, "lower")) << finding.advice;
}

TEST(TrackerFindings, BxThatIsLostIsToldFromBxThatIsRefused) {
  TrackerStartup startup;
  startup.errors[{"PINIT", 0x13}] = 1;
  aurora::PollerCounts counts;
  counts.unanswered = 12;
  const Finding finding = reply_finding(ReplyForm::kText, counts, startup);
  EXPECT_TRUE(says(finding.found, "no whole BX reply has come; 12 questions")) << finding.found;
}

TEST(TrackerFindings, AnAdapterThatHoldsRepliesBackGetsItsCure) {
  const UsbIdentity identity{0x0403, 0x6001, 0, BoundedText<64>("FT1234")};
  const Finding slow = adapter_finding({true, "ttyUSB0", identity, 16});
  EXPECT_EQ(slow.verdict, Verdict::kAdvice);
  EXPECT_TRUE(says(slow.found, "latency timer 16 ms")) << slow.found;
  EXPECT_TRUE(says(slow.advice, "ttyUSB0/latency_timer")) << slow.advice;
  EXPECT_EQ(adapter_finding({true, "ttyUSB0", identity, 1}).verdict, Verdict::kGood);
  EXPECT_EQ(adapter_finding({true, "ttyUSB0", identity, std::nullopt}).verdict, Verdict::kGood);
}

}  // namespace
}  // namespace tubed
