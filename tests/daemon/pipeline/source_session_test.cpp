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

/// Opens it when that is due, and reads; true when a frame came.
bool read(Session& session, EmFrame& frame, const Clock& clock) {
  session.wait(clock);
  return session.open(clock) && session.read(frame, clock) == ReadOutcome::kFrame;
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
  EXPECT_TRUE(read(session, frame, clock));
  EXPECT_EQ(frame.tracker_frame, 1U);
  EXPECT_EQ(report_of(session).state, StageState::kRunning);
}

/// Looks for its device by itself, as it is told.
class EmSourceWithCondition final : public EmSource, public HasCondition {
 public:
  explicit EmSourceWithCondition(SourceCondition& told) : told_(told) {}
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(EmFrame& /*frame*/) noexcept override {
    return told_.state == DeviceState::kRunning ? ReadOutcome::kFrame : ReadOutcome::kNothing;
  }
  SourceCondition condition() noexcept override { return told_; }
  void close() noexcept override {}

 private:
  SourceCondition& told_;
};

TEST(SourceSession, WhatASourceRepeatsOfItsDeviceIsMadePrintable) {
  FakeClock clock;
  SourceCondition told{DeviceState::kStarting, BoundedText<255>("the tracker says 'A\nB\x1b\xFF'")};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  read(session, frame, clock);
  EXPECT_STREQ(report_of(session).why.data(), "the tracker says 'A\uFFFDB\uFFFD\uFFFD'");
}

TEST(SourceSession, HandsOnWhatASourceSaysOfItselfWhetherItDeliversOrNot) {
  FakeClock clock;
  SourceCondition told{DeviceState::kStarting, BoundedText<255>("looking for the tracker")};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  EXPECT_FALSE(read(session, frame, clock));
  EXPECT_EQ(report_of(session).state, StageState::kStarting);
  EXPECT_STREQ(report_of(session).why.data(), "looking for the tracker");
  told = {DeviceState::kRunning, BoundedText<255>("port 2: no tool; sensor 3 left out")};
  EXPECT_TRUE(read(session, frame, clock));
  EXPECT_EQ(report_of(session).state, StageState::kRunning);
  EXPECT_STREQ(report_of(session).why.data(), "port 2: no tool; sensor 3 left out");
  told.words.clear();
  EXPECT_TRUE(read(session, frame, clock));
  EXPECT_STREQ(report_of(session).why.data(), "");
}

TEST(SourceSession, CountsADeviceThatWasFoundAgainAndNotItsSentences) {
  FakeClock clock;
  SourceCondition told{DeviceState::kRunning, {}};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  read(session, frame, clock);
  for (const char* words : {"has gone", "is not there", "does not answer at any rate"}) {
    told = {DeviceState::kReconnecting, BoundedText<255>(words)};
    read(session, frame, clock);
    EXPECT_EQ(report_of(session).state, StageState::kReconnecting);
    EXPECT_EQ(report_of(session).reconnects, 0U);
  }
  told = {DeviceState::kRunning, {}};
  read(session, frame, clock);
  EXPECT_EQ(report_of(session).reconnects, 1U);
}

/// Is lost and opened again by the session, and has words of its own beside.
class EmSourceThatIsLost final : public EmSource, public HasCondition {
 public:
  explicit EmSourceThatIsLost(std::deque<ReadOutcome> reads) : reads_(std::move(reads)) {}
  OpenResult open() override { return {++opened_ > 1, "not there"}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(EmFrame& /*frame*/) noexcept override {
    const ReadOutcome outcome = reads_.front();
    reads_.pop_front();
    delivers_ = outcome == ReadOutcome::kFrame;
    has_delivered_ = has_delivered_ || delivers_;
    return outcome;
  }
  SourceCondition condition() noexcept override {
    return {delivers_ ? DeviceState::kRunning
                      : (has_delivered_ ? DeviceState::kReconnecting : DeviceState::kStarting),
            BoundedText<255>("own words")};
  }
  void close() noexcept override { delivers_ = false; }

 private:
  std::deque<ReadOutcome> reads_;
  int opened_ = 0;
  bool delivers_ = false;
  bool has_delivered_ = false;
};

TEST(SourceSession, ASourceWithWordsThatIsLostIsFoundAgainOnceAndTheLossIsTold) {
  FakeClock clock;
  using enum ReadOutcome;
  Session session(std::make_unique<EmSourceThatIsLost>(std::deque{kFrame, kLost, kNothing, kFrame, kFrame}),
                  quick());
  EmFrame frame;
  const auto read_later = [&] {
    read(session, frame, clock);
    clock.advance(milliseconds(400));
    return report_of(session);
  };
  EXPECT_STREQ(read_later().why.data(), "not there");
  EXPECT_EQ(read_later().reconnects, 0U) << "it was not there before";
  EXPECT_STREQ(read_later().why.data(), "the device is gone; reconnecting");
  EXPECT_STREQ(read_later().why.data(), "own words");
  EXPECT_EQ(report_of(session).state, StageState::kReconnecting);
  EXPECT_EQ(read_later().reconnects, 1U);
  EXPECT_EQ(read_later().reconnects, 1U);
}

TEST(SourceSession, KeepsWordsWholeThatNameAnErrorBehindALongSentence) {
  FakeClock clock;
  const std::string words = std::string(200, 'x') + " ERROR13";
  SourceCondition told{DeviceState::kRunning, BoundedText<255>(words)};
  Session session(std::make_unique<EmSourceWithCondition>(told), quick());
  EmFrame frame;
  read(session, frame, clock);
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
    read(session, frame, clock);
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

class LocalSource final : public EmSource, public IsFedLocally {
 public:
  explicit LocalSource(int& opened) : opened_(opened) {}
  OpenResult open() override { return {++opened_ > 1000, "nobody writes"}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(EmFrame& /*frame*/) noexcept override { return ReadOutcome::kNothing; }
  void close() noexcept override {}

 private:
  int& opened_;
};

TEST(SourceSession, AProgramOfThisMachineIsAskedForWithoutAGrowingBackOff) {
  FakeClock clock;
  int opened = 0;
  Session session(std::make_unique<LocalSource>(opened), quick());
  EmFrame frame;
  for (int ms = 0; ms < 2000; ms += 50) {
    read(session, frame, clock);
    clock.advance(milliseconds(50));
  }
  EXPECT_EQ(opened, 40) << "every 50 ms";
}

TEST(SourceSession, TheReasonOfARefusedOpenReachesTheReportInWords) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque<ReadOutcome>{}, std::deque{false}, log), quick());
  EmFrame frame;
  read(session, frame, clock);
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
  EXPECT_TRUE(read(session, frame, clock));
  EXPECT_FALSE(read(session, frame, clock));
  EXPECT_EQ(log.closed, 1);
  EXPECT_EQ(report_of(session).state, StageState::kReconnecting);
  clock.advance(milliseconds(100));
  EXPECT_TRUE(read(session, frame, clock));
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
  EXPECT_FALSE(read(session, frame, clock));
  EXPECT_TRUE(read(session, frame, clock));
  EXPECT_EQ(report_of(session).refused, 1U);
  EXPECT_EQ(log.opened, 1);
}

TEST(SourceSession, AnEndedRecordingIsNeverReopened) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kEnded}, std::deque<bool>{}, log),
                  quick());
  EmFrame frame;
  read(session, frame, clock);
  session.interrupt();  // the wait that an ended source makes is cut short
  EXPECT_FALSE(read(session, frame, clock));
  EXPECT_EQ(log.opened, 1);
  EXPECT_EQ(report_of(session).state, StageState::kEnded);
}

TEST(SourceSession, WaitingNeitherOpensNorReads) {
  FakeClock clock;
  FakeEmSource::Log log;
  Session session(std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kFrame}, std::deque<bool>{}, log),
                  quick());
  session.wait(clock);
  EXPECT_EQ(log.opened, 0);
  ASSERT_TRUE(session.open(clock));
  session.wait(clock);
  session.wait(clock);
  EXPECT_EQ(log.read, 0);
  EmFrame frame;
  EXPECT_EQ(session.read(frame, clock), ReadOutcome::kFrame);
}

// Or what has come already would be handed on only when more comes.
TEST(SourceSession, WaitsForASourceOnlyAfterItHadNothingMore) {
  FakeClock clock;
  FakeEmSource::Log log;
  using enum ReadOutcome;
  Session session(
      std::make_unique<FakeEmSource>(std::deque{kFrame, kRefused, kFrame, kNothing}, std::deque<bool>{}, log),
      quick());
  ASSERT_TRUE(session.open(clock));
  EmFrame frame;
  std::vector<int> waited;
  for (int i = 0; i < 5; ++i) {
    session.wait(clock);
    session.read(frame, clock);
    waited.push_back(log.waited);
  }
  EXPECT_EQ(waited, (std::vector{1, 1, 1, 1, 2}));
}

}  // namespace
}  // namespace tubed
