#include "clients/cpp/writer_choice.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdlib>
#include <map>
#include <tuple>

namespace tubed {
namespace {

// Before rapidcheck looks: as many rooms, and the same ones, each time.
const int kRooms = setenv("RC_PARAMS", "seed=20 max_success=500", 0);

constexpr double kMaxRate_hz = 120;
constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPeriod_ns = 1'000 * kMs / 30;
constexpr std::int64_t kUptime_ns = 1'000'000 * kMs;
constexpr std::int64_t kBudget_ns = 250 * kMs;  // the contract: heard again after a rival's end
constexpr std::uint64_t kReal = 1;
constexpr std::uint64_t kRival = 2;

/// One instrument, as a subscriber uses the choice; time is a value.
class Room {
 public:
  explicit Room(bool has_wakeups = true) : has_wakeups_(has_wakeups) {}

  Ruling hear(const SampleOrigin& sample, std::int64_t now_ns) {
    find_silence(now_ns);
    const Ruling ruling = choice_.judge(sample, now_ns);
    if (is_delivered(ruling)) {
      choice_.accept(sample, ruling, now_ns);
      delivered_ns_ = now_ns;
    }
    return ruling;
  }

  /// `number` of a daemon that publishes regularly.
  Ruling hear(std::uint64_t writer, std::uint64_t number, std::int64_t now_ns) {
    return hear({writer + 70, number, kUptime_ns + now_ns, writer}, now_ns);
  }

  void match(std::initializer_list<std::uint64_t> writers) { choice_.match(std::vector(writers)); }
  [[nodiscard]] const WriterChoice& choice() const { return choice_; }

 private:
  /// What the subscriber tells the choice when nothing waits in its queue.
  void find_silence(std::int64_t now_ns) {
    if (has_wakeups_ && delivered_ns_ && now_ns - *delivered_ns_ >= kBudget_ns) choice_.find_silent();
  }

  bool has_wakeups_;
  WriterChoice choice_{kMaxRate_hz};
  std::optional<std::int64_t> delivered_ns_;
};

/// Ten samples of the real daemon: it is followed from the first on. The time after them.
std::int64_t follow_real(Room& room) {
  for (std::uint64_t k = 1; k <= 10; ++k) {
    EXPECT_EQ(room.hear(kReal, k, static_cast<std::int64_t>(k) * kPeriod_ns),
              k == 1 ? Ruling::kFirst : Ruling::kNext);
  }
  return 10 * kPeriod_ns;
}

TEST(WriterChoice, TheWriterThatIsFollowedStaysSoWhileItIsAliveAndTheOtherIsARival) {
  Room room;
  std::int64_t now_ns = follow_real(room);
  for (std::uint64_t k = 1; k < 300; ++k) {
    now_ns += kPeriod_ns;
    EXPECT_EQ(room.hear(kRival, k, now_ns - 5 * kMs), Ruling::kRival) << k;
    EXPECT_EQ(room.hear(kReal, 10 + k, now_ns), Ruling::kNext) << k;
    EXPECT_EQ(room.choice().rival(now_ns), kRival);
  }
}

TEST(WriterChoice, ARivalIsForgottenASecondAfterItsLastSampleAndAtOnceWhenItIsGone) {
  for (const bool is_gone : {false, true}) {
    Room room;
    const std::int64_t now_ns = follow_real(room);
    room.hear(kRival, 1, now_ns + 1 * kMs);
    room.hear(kReal, 11, now_ns + kPeriod_ns);
    ASSERT_TRUE(room.choice().rival(now_ns + kPeriod_ns));
    if (is_gone) room.match({kReal});
    EXPECT_EQ(room.choice().rival(now_ns + 900 * kMs).has_value(), !is_gone);
    EXPECT_FALSE(room.choice().rival(now_ns + 1001 * kMs));
  }
}

TEST(WriterChoice, OneSampleOfSomebodyElseIsARivalToo) {
  Room room;
  const std::int64_t now_ns = follow_real(room);

  EXPECT_EQ(room.hear({99, 5, kUptime_ns, kRival}, now_ns + kMs), Ruling::kRival);
  EXPECT_EQ(room.hear(kReal, 11, now_ns + kPeriod_ns), Ruling::kNext);
  EXPECT_TRUE(room.choice().rival(now_ns + kPeriod_ns));
}

TEST(WriterChoice, ARestartedDaemonIsFollowedAtItsThirdSampleAndIsNoRival) {
  Room room;
  const std::int64_t now_ns = follow_real(room);
  room.match({});
  EXPECT_TRUE(room.choice().is_followed_gone());

  EXPECT_EQ(room.hear(kRival, 1, now_ns + 500 * kMs), Ruling::kRival);
  EXPECT_EQ(room.hear(kRival, 2, now_ns + 500 * kMs + kPeriod_ns), Ruling::kRival);
  EXPECT_EQ(room.hear(kRival, 3, now_ns + 500 * kMs + 2 * kPeriod_ns), Ruling::kOtherWriter);
  EXPECT_EQ(room.hear(kRival, 4, now_ns + 500 * kMs + 3 * kPeriod_ns), Ruling::kNext);
  EXPECT_EQ(room.choice().lost_before(), 0U);
  EXPECT_FALSE(room.choice().rival(now_ns + 500 * kMs + 3 * kPeriod_ns));
}

TEST(WriterChoice, ABurstIsNoProof) {
  Room room;
  const std::int64_t now_ns = follow_real(room);
  room.match({kRival});

  for (std::uint64_t k = 1; k < 20; ++k) {
    EXPECT_EQ(room.hear(kRival, k, now_ns + static_cast<std::int64_t>(k) * kMs), Ruling::kRival) << k;
  }
}

TEST(WriterChoice, ASubscriberThatWasStoppedItselfStaysWithItsWriter) {
  Room room(false);  // and its queue holds samples of the rival first
  std::int64_t now_ns = follow_real(room);
  for (std::uint64_t k = 1; k < 30; ++k) room.hear(kRival, k, now_ns + static_cast<std::int64_t>(k));
  now_ns += 800 * kMs;
  for (std::uint64_t k = 30; k < 60; ++k) {
    EXPECT_EQ(room.hear(kRival, k, now_ns + static_cast<std::int64_t>(k)), Ruling::kRival);
  }
  EXPECT_EQ(room.hear(kReal, 34, now_ns + kMs), Ruling::kNext);
}

TEST(WriterChoice, ARivalThatWasKilledIsFollowedByTheRealDaemonWithin200Milliseconds) {
  for (std::int64_t shift_ns = 0; shift_ns < kPeriod_ns; shift_ns += kMs) {
    Room room(false);
    std::int64_t now_ns = 0;
    for (std::uint64_t k = 1; k < 30; ++k) {
      now_ns += kPeriod_ns;
      room.hear(kRival, k, now_ns);
      EXPECT_EQ(room.hear(kReal, k, now_ns + shift_ns), Ruling::kRival);
    }
    const std::int64_t killed_ns = now_ns;
    std::uint64_t number = 30;
    do {
      now_ns += kPeriod_ns;
    } while (room.hear(kReal, number++, now_ns + shift_ns) == Ruling::kRival);
    EXPECT_GE(now_ns + shift_ns - killed_ns, 150 * kMs);
    EXPECT_LE(now_ns + shift_ns - killed_ns, 205 * kMs);
  }
}

TEST(WriterChoice, AStartThatTwoWritersClaimedIsHeardAgainUnderANewHandle) {
  Room room;
  std::int64_t now_ns = 0;
  std::uint64_t number = 0;
  const auto real = [&](std::uint64_t handle) {
    now_ns += kPeriod_ns;
    return room.hear({kReal + 70, ++number, kUptime_ns + now_ns, handle}, now_ns);
  };
  for (std::uint64_t k = 1; k < 30; ++k) {  // the forger is followed
    room.hear({kReal + 70, 100'000 + k, kUptime_ns + now_ns, kRival}, now_ns);
    real(kReal);
  }
  room.match({kReal});
  EXPECT_EQ(real(kReal), Ruling::kOtherWriter);
  for (int k = 0; k < 60; ++k) real(kReal);  // until the forger is forgotten
  room.match({});
  real(55);
  real(55);
  EXPECT_EQ(real(55), Ruling::kOtherWriter);
}

TEST(WriterChoice, AStartThatEndedDoesNotComeBackUnderAnotherWriter) {
  Room room;
  std::int64_t now_ns = follow_real(room);
  room.match({});
  for (std::uint64_t k = 1; k < 60; ++k) room.hear(kRival, k, now_ns += kPeriod_ns);

  const SampleOrigin recorded{kReal + 70, 7, kUptime_ns + 7 * kPeriod_ns, 55};
  EXPECT_EQ(room.hear(recorded, now_ns + kMs), Ruling::kBackward);
}

TEST(WriterChoice, ADaemonThatIsMatchedAnewAfterTheNetworkWasAwayIsHeardAgain) {
  Room room;
  std::int64_t now_ns = follow_real(room) + 20'000 * kMs;
  room.match({});
  Ruling ruling = Ruling::kRival;
  for (std::uint64_t k = 611; k < 615; ++k) {
    now_ns += kPeriod_ns;
    ruling = room.hear({kReal + 70, k, kUptime_ns + now_ns, 55}, now_ns);
  }
  EXPECT_EQ(ruling, Ruling::kNext);
}

TEST(WriterChoice, ARivalThatClaimsTheRealStartAndAHugeNumberDoesNotLockTheRealOneOut) {
  Room room;
  std::int64_t now_ns = 0;
  const auto forged = [&](std::uint64_t k) {
    return room.hear({kReal + 70, 100'000 + k, kUptime_ns + now_ns, kRival}, now_ns);
  };
  for (std::uint64_t k = 1; k < 100; ++k) {
    now_ns += kPeriod_ns;
    forged(k);
    room.hear(kReal, k, now_ns + kMs);
  }
  room.match({kReal});
  EXPECT_EQ(room.hear(kReal, 100, now_ns + kPeriod_ns), Ruling::kOtherWriter);
}

TEST(WriterChoice, WritersThatInventAStartWithEachSampleDoNotPushTheRealOneOut) {
  Room room;
  std::int64_t now_ns = 0;
  for (std::uint64_t k = 1; k < 100; ++k) {
    now_ns += kPeriod_ns;
    room.hear(kRival, k, now_ns);
    room.hear(kReal, k, now_ns + kMs);
    for (std::uint64_t forger = 0; forger < 50; ++forger) {
      room.hear({1000 * k + forger, 1, kUptime_ns, 3 + forger % 6}, now_ns + 2 * kMs);
    }
  }
  room.match({kReal});
  EXPECT_EQ(room.hear(kReal, 100, now_ns + kPeriod_ns), Ruling::kOtherWriter);
}

/// What a rival sends at a time: numbers, starts and times of its choice, from handles of its own.
struct Forgery {
  std::int64_t at_ns;
  SampleOrigin sample;
};

/// Streams of a daemon's looks and single samples, of five writers, between 0 and `end_ns`.
std::vector<Forgery> forgeries(std::int64_t end_ns) {
  std::vector<Forgery> all;
  const int streams = *rc::gen::inRange(0, 6);
  for (int i = 0; i < streams; ++i) {
    const auto writer = static_cast<std::uint64_t>(*rc::gen::inRange(2, 7));
    // Its own start, the real daemon's, or one that changes.
    const auto start = *rc::gen::element<std::uint64_t>(kReal + 70, writer + 70, writer + 90);
    const auto step_ns = *rc::gen::inRange<std::int64_t>(1, 80) * kMs;
    auto number = *rc::gen::element<std::uint64_t>(1, 500, 100'000, std::uint64_t{1} << 60U);
    const auto gain = static_cast<std::uint64_t>(*rc::gen::inRange(0, 5));
    const auto clock_ns = *rc::gen::inRange<std::int64_t>(-1000, 1000) * 1'000 * kMs;
    const auto from_ns = *rc::gen::inRange<std::int64_t>(0, end_ns / kMs) * kMs;
    const bool stays = *rc::gen::arbitrary<bool>();
    const auto to_ns =
        stays ? end_ns : *rc::gen::inRange<std::int64_t>(from_ns / kMs, end_ns / kMs + 1) * kMs;
    for (std::int64_t at_ns = from_ns; at_ns < to_ns; at_ns += step_ns) {
      all.push_back({at_ns, {start, number, kUptime_ns + clock_ns + at_ns, writer}});
      number += gain;
    }
  }
  return all;
}

using Timeline = std::multimap<std::int64_t, SampleOrigin>;

/// The real daemon from `from_ns` to `until_ns`, with a jitter of milliseconds.
void add_real(Timeline& timeline, std::int64_t from_ns, std::int64_t until_ns) {
  std::uint64_t number = 1;
  for (std::int64_t at_ns = from_ns; at_ns < until_ns; at_ns += kPeriod_ns) {
    const std::int64_t jitter_ns = *rc::gen::inRange<std::int64_t>(0, 10) * kMs;
    timeline.insert({at_ns + jitter_ns, {kReal + 70, number++, kUptime_ns + at_ns, kReal}});
  }
}

TEST(WriterChoice, WhateverARivalSendsShapesComeInOrderFromOneWriterAndTheRealOneIsHeardAgainIn250Ms) {
  const bool holds = rc::check([] {
    constexpr std::int64_t kRivalsEnd_ns = 3'000 * kMs;
    Timeline timeline;
    for (const Forgery& forgery : forgeries(kRivalsEnd_ns)) timeline.insert({forgery.at_ns, forgery.sample});
    add_real(timeline, *rc::gen::inRange<std::int64_t>(0, 2'500) * kMs, 5'000 * kMs);
    const bool says_goodbye = *rc::gen::arbitrary<bool>();
    Room room;
    SampleOrigin last;
    std::optional<std::int64_t> last_rival_ns;
    std::optional<std::int64_t> real_again_ns;
    bool is_over = false;
    for (const auto& [at_ns, sample] : timeline) {
      if (at_ns >= kRivalsEnd_ns && !is_over) {
        is_over = true;
        if (says_goodbye) room.match({kReal});
      }
      const Ruling ruling = room.hear(sample, at_ns);
      if (sample.writer != kReal) last_rival_ns = at_ns;
      if (sample.writer == kReal && is_delivered(ruling) && is_over) {
        real_again_ns = real_again_ns.value_or(at_ns);
      }
      if (ruling == Ruling::kNext) {
        RC_ASSERT(std::tie(sample.writer, sample.daemon_start) == std::tie(last.writer, last.daemon_start));
        RC_ASSERT(sample.sequence_number > last.sequence_number);
        RC_ASSERT(sample.publish_monotonic_ns >= last.publish_monotonic_ns);
      }
      if (is_over && sample.writer == kReal && at_ns > kRivalsEnd_ns + kBudget_ns) {
        RC_ASSERT(is_delivered(ruling));
      }
      if (is_delivered(ruling)) last = sample;
    }
    RC_ASSERT(real_again_ns.has_value());
    RC_ASSERT(*real_again_ns - kRivalsEnd_ns <= kBudget_ns);
    RC_TAG(last_rival_ns.has_value());
  });
  EXPECT_TRUE(holds);
}

TEST(WriterChoice, ADaemonThatIsFollowedFirstIsDeliveredWholeWhateverARivalSends) {
  const bool holds = rc::check([] {
    Timeline timeline;
    for (const Forgery& forgery : forgeries(3'000 * kMs)) {
      timeline.insert({forgery.at_ns + 100 * kMs, forgery.sample});
    }
    add_real(timeline, 0, 4'000 * kMs);
    Room room;
    for (const auto& [at_ns, sample] : timeline) {
      const Ruling ruling = room.hear(sample, at_ns);
      RC_ASSERT(is_delivered(ruling) == (sample.writer == kReal));
    }
  });
  EXPECT_TRUE(holds);
}

}  // namespace
}  // namespace tubed
