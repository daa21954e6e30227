#include "daemon/pipeline/source_session.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using Session = SourceSession<EmSource, EmFrame>;
using std::chrono::milliseconds;

PipelineSettings quick() {
  PipelineSettings settings;
  settings.reconnect_first_ms = 100;
  settings.reconnect_last_ms = 400;
  return settings;
}

StageReport report_of(const Session& session) {
  StageReport report;
  session.describe(report);
  return report;
}

TEST(SourceSession, OpensTheSourceAndHandsOnItsFrames) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kFrame}, std::deque<bool>{}, log),
                  quick());
  EmFrame frame;
  EXPECT_TRUE(session.read(frame, clock));
  EXPECT_EQ(frame.tracker_frame, 1U);
  EXPECT_EQ(report_of(session).state, StageState::kRunning);
}

/// Looks for its device by itself, as it is told.
class EmSourceWithCondition final : public EmSource, public HasCondition {
 public:
  explicit EmSourceWithCondition(SourceCondition& told) : told_(told) {}
  OpenResult open() override { return {true, {}}; }
  ReadOutcome read(EmFrame& /*frame*/, MonotonicTime /*deadline*/) noexcept override {
    return told_.state == DeviceState::kRunning ? ReadOutcome::kFrame : ReadOutcome::kTimeout;
  }
  SourceCondition condition() noexcept override { return told_; }
  void close() noexcept override {}

 private:
  SourceCondition& told_;
};

TEST(SourceSession, HandsOnWhatASourceSaysOfItselfWhetherItDeliversOrNot) {
  FakeClock clock;
  SourceCondition told{DeviceState::kStarting, BoundedText<255>("looking for the tracker")};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  EXPECT_FALSE(session.read(frame, clock));
  EXPECT_EQ(report_of(session).state, StageState::kStarting);
  EXPECT_STREQ(report_of(session).why.data(), "looking for the tracker");
  told = {DeviceState::kRunning, BoundedText<255>("port 2: no tool; sensor 3 left out")};
  EXPECT_TRUE(session.read(frame, clock));
  EXPECT_EQ(report_of(session).state, StageState::kRunning);
  EXPECT_STREQ(report_of(session).why.data(), "port 2: no tool; sensor 3 left out");
  told.words.clear();
  EXPECT_TRUE(session.read(frame, clock));
  EXPECT_STREQ(report_of(session).why.data(), "");
}

TEST(SourceSession, CountsADeviceThatWasFoundAgainAndNotItsSentences) {
  FakeClock clock;
  SourceCondition told{DeviceState::kRunning, {}};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  session.read(frame, clock);
  for (const char* words : {"has gone", "is not there", "does not answer at any rate"}) {
    told = {DeviceState::kReconnecting, BoundedText<255>(words)};
    session.read(frame, clock);
    EXPECT_EQ(report_of(session).state, StageState::kReconnecting);
    EXPECT_EQ(report_of(session).reconnects, 0U);
  }
  told = {DeviceState::kRunning, {}};
  session.read(frame, clock);
  EXPECT_EQ(report_of(session).reconnects, 1U);
}

TEST(SourceSession, KeepsWordsWholeThatNameAnErrorBehindALongSentence) {
  FakeClock clock;
  const std::string words = std::string(200, 'x') + " ERROR13";
  SourceCondition told{DeviceState::kRunning, BoundedText<255>(words)};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  session.read(frame, clock);
  EXPECT_EQ(std::string(report_of(session).why.data()), words);
}

TEST(SourceSession, ATrackerThatIsAbsentIsTriedAgainAfterADoublingBackOff) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque<ReadOutcome>{},
                                                 std::deque{false, false, false, false, false}, log),
                  quick());
  EmFrame frame;
  std::vector<int> opened;
  for (int ms = 0; ms < 1600; ms += 50) {  // tries are due at 0, 100, 300, 700 and then every 400
    session.read(frame, clock);
    opened.push_back(log.opened);
    clock.advance(milliseconds(50));
  }
  EXPECT_EQ(opened[0], 1);
  EXPECT_EQ(opened[1], 1);
  EXPECT_EQ(opened[2], 2);
  EXPECT_EQ(opened[6], 3);
  EXPECT_EQ(opened[14], 4);
  EXPECT_EQ(opened[22], 5);
  EXPECT_EQ(opened[30], 6) << "the back-off stops growing";
}

TEST(SourceSession, TheReasonOfARefusedOpenReachesTheReportInWords) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque<ReadOutcome>{}, std::deque{false}, log), quick());
  EmFrame frame;
  session.read(frame, clock);
  EXPECT_EQ(report_of(session).state, StageState::kReconnecting);
  EXPECT_STREQ(report_of(session).why.data(), "no tracker on the line; is it plugged in?");
}

TEST(SourceSession, ALostDeviceIsClosedAndOpenedAgain) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(
      std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kFrame, ReadOutcome::kLost, ReadOutcome::kFrame},
                                     std::deque<bool>{}, log),
      quick());
  EmFrame frame;
  EXPECT_TRUE(session.read(frame, clock));
  EXPECT_FALSE(session.read(frame, clock));
  EXPECT_EQ(log.closed, 1);
  EXPECT_EQ(report_of(session).state, StageState::kReconnecting);
  clock.advance(milliseconds(100));
  EXPECT_TRUE(session.read(frame, clock));
  EXPECT_EQ(report_of(session).reconnects, 1U);
  EXPECT_EQ(report_of(session).state, StageState::kRunning);
}

TEST(SourceSession, RefusedFramesAreCountedAndTheSourceStaysOpen) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kRefused, ReadOutcome::kFrame},
                                                 std::deque<bool>{}, log),
                  quick());
  EmFrame frame;
  EXPECT_FALSE(session.read(frame, clock));
  EXPECT_TRUE(session.read(frame, clock));
  EXPECT_EQ(report_of(session).refused, 1U);
  EXPECT_EQ(log.opened, 1);
}

TEST(SourceSession, AnEndedRecordingIsNeverReopened) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kEnded}, std::deque<bool>{}, log),
                  quick());
  EmFrame frame;
  session.read(frame, clock);
  session.interrupt();  // the wait that an ended source makes is cut short
  EXPECT_FALSE(session.read(frame, clock));
  EXPECT_EQ(log.opened, 1);
  EXPECT_EQ(report_of(session).state, StageState::kEnded);
}

}  // namespace
}  // namespace tubed
