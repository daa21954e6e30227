#include "drivers/aurora/frame_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tubed::aurora {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr MonotonicTime kStart = from_ns(5'000'000'000);

/// A tracker that measures every `period_ns`, asked as often as said; replies begin `delay` after the
/// question.
class Asked {
 public:
  explicit Asked(double period_ns) : period_ns_(period_ns) {}

  [[nodiscard]] MonotonicTime truth(std::uint64_t n) const {
    return kStart + nanoseconds(std::llround(period_ns_ * static_cast<double>(n)));
  }
  [[nodiscard]] std::uint64_t newest(MonotonicTime time) const {
    return static_cast<std::uint64_t>(static_cast<double>((time - kStart).count()) / period_ns_);
  }
  /// Asks at `time`; the tracker hears it at once.
  std::uint64_t ask(MonotonicTime time, nanoseconds delay) {
    const std::uint64_t n = newest(time);
    clock.observe(n, time, time + delay);
    return n;
  }
  /// In the middle of what is possible, for so many measurements.
  void ask_in_the_middle(int times) {
    std::uint64_t n = ask(kStart + milliseconds(7), microseconds(500));
    MonotonicTime now = kStart + milliseconds(7);
    for (int i = 0; i < times; ++i) {
      now = std::max(now + milliseconds(3), clock.range(n + 1).middle());
      n = ask(now, microseconds(500));
    }
    last = n;
  }

  FrameClock clock;
  std::uint64_t last = 0;

 private:
  double period_ns_;
};

class FrameClockAtRate : public testing::TestWithParam<double> {};

TEST_P(FrameClockAtRate, LearnsPeriodAndPhaseWhateverTheRate) {
  Asked tracker(1e9 / GetParam());
  tracker.ask_in_the_middle(400);
  const auto range = tracker.clock.range(tracker.last);
  EXPECT_NEAR(tracker.clock.period_ns(), 1e9 / GetParam(), 5e3);
  EXPECT_LE(range.earliest, tracker.truth(tracker.last));
  EXPECT_GE(range.latest, tracker.truth(tracker.last));
  EXPECT_LT(range.width(), milliseconds(2));
  EXPECT_EQ(tracker.clock.contradictions(), 0U);
}

INSTANTIATE_TEST_SUITE_P(All, FrameClockAtRate, testing::Values(38.0, 39.996, 40.0, 40.4, 44.0));

TEST(FrameClock, IsNotMovedByLateReplies) {
  std::mt19937 random(3);
  Asked tracker(25e6);
  MonotonicTime now = kStart + milliseconds(7);
  for (int i = 0; i < 2000; ++i) {
    const nanoseconds late = microseconds(300 + (random() % 10 == 0 ? random() % 30000 : random() % 500));
    tracker.last = tracker.ask(now, late);
    now = std::max(now + late + milliseconds(3), tracker.clock.range(tracker.last + 1).middle());
    const auto range = tracker.clock.range(tracker.last);
    ASSERT_LE(range.earliest, tracker.truth(tracker.last) + microseconds(1)) << i;
    ASSERT_GE(range.latest, tracker.truth(tracker.last) - microseconds(1)) << i;
  }
  EXPECT_LT(tracker.clock.range(tracker.last).width(), milliseconds(2));
}

TEST(FrameClock, DisbelievesAReplyThatBelongedToAnEarlierQuestion) {
  Asked tracker(25e6);
  tracker.ask_in_the_middle(400);
  const auto before = tracker.clock.range(tracker.last).middle() - tracker.truth(tracker.last);
  const MonotonicTime asked = tracker.truth(tracker.last + 1) + milliseconds(15);
  tracker.clock.observe(tracker.last, asked, asked + milliseconds(1));  // the next one was there long ago
  const auto after = tracker.clock.range(tracker.last).middle() - tracker.truth(tracker.last);
  EXPECT_EQ(tracker.clock.contradictions(), 1U);
  EXPECT_LT(std::abs((after - before).count()), 100'000);
}

// A tracker that long answered with the measurement before the newest: then one bound shows what was wrong.
TEST(FrameClock, KnowsThePeriodStillWhenWhatItBelievedOfThePhaseWasWrong) {
  Asked tracker(25e6);
  for (std::uint64_t n = 0; n < 1500; ++n) {
    const MonotonicTime asked = tracker.truth(n + 1) + milliseconds(3);
    tracker.clock.observe(n, asked, asked + microseconds(500));
  }
  ASSERT_TRUE(tracker.clock.knows_period());
  tracker.clock.observe(1500, std::nullopt, tracker.truth(1500) + microseconds(500));
  EXPECT_GT(tracker.clock.contradictions(), 0U);
  EXPECT_NEAR(tracker.clock.period_ns(), 25e6, 0.2e6);
}

TEST(FrameClock, TakesAQuestionThatCameTooEarlyAsAProofAlsoWhenLaterMeasurementsAreKnown) {
  Asked tracker(25e6);
  tracker.ask(kStart + milliseconds(7), milliseconds(1));
  tracker.clock.observe(1, std::nullopt, tracker.truth(1) + milliseconds(20));
  const auto before = tracker.clock.range(1).width();
  tracker.clock.not_there(1, tracker.truth(1) - milliseconds(2));
  EXPECT_LT(tracker.clock.range(1).width(), before - milliseconds(10));
  EXPECT_LE(tracker.clock.range(1).earliest, tracker.truth(1));
}

TEST(FrameClock, SaysHowLittleItKnowsWhenNoQuestionIsKnown) {
  FrameClock clock;
  clock.observe(0, std::nullopt, kStart);
  EXPECT_GE(clock.range(0).width(), milliseconds(500));
}

TEST(FrameClock, KnowsNoMoreThanAPeriodAfterOneReply) {
  Asked tracker(25e6);
  tracker.ask(kStart + milliseconds(7), milliseconds(1));
  const auto range = tracker.clock.range(0);
  EXPECT_EQ(range.latest, kStart + milliseconds(8));
  EXPECT_GE(range.width(), milliseconds(20));
}

}  // namespace
}  // namespace tubed::aurora
