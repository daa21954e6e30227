#include "drivers/aurora/frame_admission.hpp"

#include <cmath>

#include "drivers/aurora/frame_counter.hpp"

namespace tubed::aurora {

namespace {

/// Time that the counter needs from one number to the other, ns; negative: it would have to run backwards.
double counted_ns(std::uint32_t from, std::uint32_t to, double period_ns) noexcept {
  const auto counts = static_cast<std::int32_t>(to - from);  // through the wrap at 2^32
  return counts / static_cast<double>(kCountsPerMeasurement) * period_ns;
}

double ns_between(MonotonicTime from, MonotonicTime to) noexcept {
  return static_cast<double>((to - from).count());
}

double as_ns(std::chrono::nanoseconds duration) noexcept { return static_cast<double>(duration.count()); }

}  // namespace

FrameAdmission::Verdict FrameAdmission::judge(std::uint32_t number, MonotonicTime now,
                                              double period_ns) noexcept {
  if (expected(number, now, period_ns)) {
    admit(number, now);
    return Verdict::kExpected;
  }
  if (confirms(number, now, period_ns)) {
    has_last_ = false;  // where the counter was says nothing any more
    admit(number, now);
    return Verdict::kConfirmed;
  }
  // The first time that a standing number was seen counts: the longer it stands, the less the next one fits.
  if (!has_candidate_ || candidate_ != number) {
    has_candidate_ = true;
    candidate_ = number;
    candidate_came_ = now;
  }
  return Verdict::kHeldBack;
}

bool FrameAdmission::expected(std::uint32_t number, MonotonicTime now, double period_ns) const noexcept {
  if (!has_last_) {
    return false;
  }
  if (number == last_) {
    return !proving_;  // a repetition while tracking; behind a restart, a counter that may stand still
  }
  const double elapsed_ns = ns_between(last_came_, now);
  const double advance_ns = counted_ns(last_, number, period_ns);
  if (proving_ && (advance_ns <= 0 || elapsed_ns > as_ns(kMaxExtrapolation))) {
    return false;
  }
  return std::abs(advance_ns - elapsed_ns) <= as_ns(kTolerance);
}

bool FrameAdmission::confirms(std::uint32_t number, MonotonicTime now, double period_ns) const noexcept {
  if (!has_candidate_) {
    return false;
  }
  const double advance_ns = counted_ns(candidate_, number, period_ns);
  return advance_ns > 0 &&
         std::abs(advance_ns - ns_between(candidate_came_, now)) <= as_ns(kConfirmationTolerance);
}

void FrameAdmission::admit(std::uint32_t number, MonotonicTime now) noexcept {
  proving_ = has_candidate_ = false;
  const bool newer = !has_last_ || static_cast<std::int32_t>(number - last_) > 0;
  if (newer) {
    has_last_ = true;
    last_ = number;
    last_came_ = now;
  }
}

}  // namespace tubed::aurora
