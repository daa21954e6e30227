// Every fault by chance: what a reader of the protocol takes in, what it loses, how soon it is back. In
// virtual time. TUBED_FAULT_REPLIES says how many replies each line of the table is made from.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "drivers/aurora/frame_counter.hpp"
#include "drivers/laboratory/aurora_emulator/control.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

using std::chrono::nanoseconds;

enum class Encoding { kBinary, kText };

std::uint64_t replies_wanted() {
  const char* const wanted = std::getenv("TUBED_FAULT_REPLIES");
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  constexpr std::uint64_t kUsual = 500;
#else
  constexpr std::uint64_t kUsual = 5'000;
#endif
  return wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : kUsual;
}

/// Asks again and again and takes what the protocol's own checks let through.
class Poller {
 public:
  explicit Poller(Encoding encoding)
      : command_(encoding == Encoding::kBinary ? bx_command(kTransforms | kAlsoOutOfVolume)
                                               : tx_command(kTransforms | kAlsoOutOfVolume)) {
    host_.device.measurements().on_measurement = [this](const Measurement& one) { truth(one.frame) = one; };
    start();
  }

  Device& device() { return host_.device; }

  /// One command, and everything that comes within a measurement's time after its reply: how many
  /// measurements not seen before.
  int poll() {
    new_measurements_ = 0;
    const bool was_owed = owed_ > 0;
    const MonotonicTime sent = host_.now;
    host_.send(command_.bytes());
    ++owed_;
    read_until(sent + (was_owed ? 3 : 1) * kTimeout, [this] { return owed_ == 0; });
    if (owed_ > 0) {
      give_up();
    }
    if (was_owed) {
      owed_ = 0;  // what has not come by now will not
    }
    // So long that the next reply is of another measurement for certain.
    read_until(host_.now + kPeriod, [] { return false; });
    give_up();
    unanswered_ = heard_ ? 0 : unanswered_ + 1;
    heard_ = false;
    const int taken = new_measurements_;
    if (reset_seen_ || unanswered_ >= kUnansweredUntilRestart) {
      start();
    }
    return taken;
  }

  /// Commands in a row without any reply until everything is begun anew.
  static constexpr int kUnansweredUntilRestart = 3;

  std::uint64_t wrong = 0;  ///< poses taken that the tracker did not measure

 private:
  static constexpr auto kTimeout = milliseconds(100);
  static constexpr auto kPeriod = milliseconds(25);
  static constexpr std::array<std::uint8_t, 5> kHandles = {0x0A, 0x0B, 0x0C, 0x0D, 0x0E};
  static constexpr std::array<std::size_t, 5> kSensors = {1, 3, 5, 2, 4};

  Measurement& truth(std::uint32_t frame) { return truth_[frame / kCountsPerMeasurement % truth_.size()]; }

  void start() {
    do {
      host_.now += milliseconds(100);
      host_.rate = 9600;
      host_.device.receive_break(host_.now);
      host_.listen();
    } while (host_.ask(init_command()) != "OKAY");
    host_.prepare();
    LinkParameters fast;
    fast.rate = BaudRate::k115200;
    host_.ask(comm_command(fast));
    host_.rate = 115200;
    host_.ask(tstart_command());
    host_.now += kPeriod;
    frames_.reset();
    reader_.clear();
    reset_seen_ = heard_ = false;
    unanswered_ = owed_ = 0;
  }

  template <typename Done>
  void read_until(MonotonicTime end, Done done) {
    while (!done() && host_.device.next_event() <= end) {
      host_.now = std::max(host_.now, host_.device.next_event());
      bytes_.clear();
      host_.device.transmit(host_.now, host_.rate, bytes_);
      reader_.feed(bytes_);
      take_replies();
    }
    host_.now = done() ? host_.now : std::max(host_.now, end);
  }

  void give_up() {
    while (reader_.waiting() > 0) {
      reader_.give_up_waiting();
      take_replies();
    }
  }

  void take_replies() {
    while (const auto reply = reader_.next()) {
      heard_ = true;
      reset_seen_ |= reply->kind == ReplyKind::kReset;
      if (reply->kind == ReplyKind::kError) {
        settle_one();
      }
      TrackingReply tracking;
      if (reply->kind == ReplyKind::kBinary
              ? decode_bx(reply->payload, tracking)
              : reply->kind == ReplyKind::kText && decode_tx(reply->text(), tracking)) {
        take(tracking);
      }
    }
  }

  void take(const TrackingReply& tracking) {
    const auto frame = common_frame(tracking);
    if (!frame || !lists_exactly(tracking, kHandles)) {
      return;
    }
    const FrameKind kind = frames_.observe(*frame).kind;
    if (kind == FrameKind::kDuplicate || kind == FrameKind::kOld) {
      return;
    }
    ++new_measurements_;
    settle_one();
    for (std::size_t i = 0; i < kHandles.size(); ++i) {
      wrong += as_measured(tracking.handles[i], kSensors[i]) ? 0 : 1;
    }
  }

  void settle_one() { owed_ -= owed_ > 0 ? 1 : 0; }

  bool as_measured(const HandleReading& reading, std::size_t sensor) {
    const Measurement& measured = truth(reading.frame);
    const CoilSample was = coil_sample(measured.coils[sensor - 1]);
    const CoilSample is = coil_sample(reading);
    if (measured.frame != reading.frame || was.status != is.status) {
      return false;
    }
    const bool posed = was.p_em_mm.allFinite();
    return posed == is.p_em_mm.allFinite() && (!posed || ((was.p_em_mm - is.p_em_mm).norm() < 0.009 &&
                                                          (was.tangent_em - is.tangent_em).norm() < 3e-4));
  }

  Host host_;
  CommandLine command_;
  ReplyReader reader_;
  FrameCounter frames_;
  std::array<Measurement, 256> truth_;
  std::vector<std::uint8_t> bytes_;
  int owed_ = 0;  ///< commands whose reply may still come
  bool heard_ = false;
  bool reset_seen_ = false;
  int unanswered_ = 0;
  int new_measurements_ = 0;
};

struct Outcome {
  double polls = 0;
  double struck = 0;
  double lost = 0;  ///< measurements asked for and never had
  int behind = 0;   ///< good replies in a row from which there was no measurement, at most
  std::uint64_t wrong = 0;
};

Outcome outcome_of(Fault fault, double probability, Encoding encoding) {
  Poller poller(encoding);
  poller.poll();
  Faults& faults = poller.device().faults();
  faults.set(fault, {probability, 0, Scope::kTracking});
  Outcome outcome;
  int behind = 0;
  const std::uint64_t wanted = replies_wanted();
  for (std::uint64_t i = 0; i < wanted; ++i) {
    const std::uint64_t before = faults.struck(fault);
    const int taken = poller.poll();
    const bool struck = faults.struck(fault) > before;
    behind = taken > 0 || struck ? 0 : behind + 1;
    outcome.behind = std::max(outcome.behind, behind);
    outcome.lost += 1 - taken;
  }
  outcome.polls = static_cast<double>(wanted);
  outcome.struck = static_cast<double>(faults.struck(fault));
  outcome.wrong = poller.wrong;
  return outcome;
}

/// What one strike costs and how sure that is.
struct Cost {
  double share = 1;        ///< of measurements lost a strike
  double sigma_share = 0;  ///< of one strike
  int behind = 0;          ///< good replies without a measurement after it
};

Cost expected_cost(Fault fault, Encoding encoding) {
  const auto by_chance = [](double share) { return Cost{share, std::sqrt(share * (1 - share)), 0}; };
  switch (fault) {
    case Fault::kBreak:
    case Fault::kHangUp:
    case Fault::kPowerCycle:
      // The tracker is silent, and begun anew after three unanswered commands.
      return {Poller::kUnansweredUntilRestart, 0, Poller::kUnansweredUntilRestart - 1};
    case Fault::kGarbage:
      // Noise belongs to the line behind it when its last byte is one of 97 characters of text.
      return encoding == Encoding::kText ? by_chance(97.0 / 256) : Cost{0, 0, 0};
    case Fault::kLength:
      // In text a doubled carriage return is none.
      return encoding == Encoding::kText ? by_chance(1 - 1 / 390.0) : Cost{};
    case Fault::kDuplicate:
    case Fault::kSplit:
    case Fault::kDelay:  // the measurement comes, late
    case Fault::kCoilBroken:
    case Fault::kOutOfVolume:
    case Fault::kStuck:
      return {0, 0, fault == Fault::kDelay ? 1 : 0};
    default:
      return {};
  }
}

/// A standstill and a jump of the counter cost what they are told to: the tests of Measurements have them.
bool is_of_the_counter(Fault fault) {
  return fault == Fault::kStandstill || fault == Fault::kCountBack || fault == Fault::kCountOn;
}

bool is_of_replies(Fault fault) { return static_cast<std::size_t>(fault) < kReplyFaultCount; }

void check(Fault fault, double probability, Encoding encoding, const Outcome& outcome) {
  const Cost cost = expected_cost(fault, encoding);
  if (is_of_replies(fault)) {
    const double answered = outcome.polls - cost.behind * outcome.struck * (fault == Fault::kDelay ? 0 : 1);
    EXPECT_NEAR(outcome.struck, probability * answered, 5 * std::sqrt(probability * answered));
  } else {
    EXPECT_GT(outcome.struck, 0.7 * probability * outcome.polls);
  }
  EXPECT_EQ(outcome.wrong, 0U);
  // The last strike may not be over when the trial is.
  EXPECT_NEAR(outcome.lost, cost.share * outcome.struck,
              5 * cost.sigma_share * std::sqrt(outcome.struck) + std::max(cost.share, 1.0));
  EXPECT_LE(outcome.behind, cost.behind);
}

class FaultsByChance : public testing::TestWithParam<Encoding> {};
INSTANTIATE_TEST_SUITE_P(Both, FaultsByChance, testing::Values(Encoding::kBinary, Encoding::kText));

TEST_P(FaultsByChance, BringNoWrongPoseAndCostTheReplyTheyStrikeOnly) {
  std::printf("%-14s %7s %9s %8s %8s %9s %7s %6s\n", "fault", "chance", "replies", "struck", "lost",
              "expected", "behind", "wrong");
  for (std::size_t i = 0; i < kFaultCount; ++i) {
    const auto fault = static_cast<Fault>(i);
    if (is_of_the_counter(fault)) {
      continue;
    }
    for (const double probability : {0.01, 0.1}) {
      const std::string name(fault_name(fault));
      SCOPED_TRACE(name);
      const Outcome outcome = outcome_of(fault, probability, GetParam());
      std::printf("%-14s %6.0f%% %9.0f %8.0f %8.0f %9.0f %7d %6llu\n", name.c_str(), 100 * probability,
                  outcome.polls, outcome.struck, outcome.lost,
                  expected_cost(fault, GetParam()).share * outcome.struck, outcome.behind,
                  static_cast<unsigned long long>(outcome.wrong));
      check(fault, probability, GetParam(), outcome);
    }
  }
}

}  // namespace
}  // namespace tubed::aurora::emulator
