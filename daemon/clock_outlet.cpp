#include "daemon/clock_outlet.hpp"

#include <spdlog/spdlog.h>

#include "daemon/publishing/clock_pair.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kLookPeriod_ns = 1'000'000'000;

void log_reference(ClockReference reference) {
  switch (reference) {
    case ClockReference::kFollowed:
      spdlog::info("the real-time clock follows a reference");
      break;
    case ClockReference::kNone:
      spdlog::warn(
          "the real-time clock follows no reference: times on other hosts cannot be compared with this "
          "host's. Run an NTP or PTP client here and there, e.g. chrony");
      break;
    case ClockReference::kUnknown:
      spdlog::warn(
          "whether the real-time clock follows a reference is not known, the kernel refuses to tell: as a "
          "service, add ProtectClock=no and SystemCallFilter=adjtimex to the drop-in that opens the network");
      break;
  }
}

}  // namespace

bool ClockOutlet::publish(const TubeEstimate& estimate) {
  look();
  if (!is_flagged()) {
    return ForwardingOutlet::publish(estimate);
  }
  flagged_estimate_ = estimate;
  flagged_estimate_.reasons.add(Reason::kClockUnsynced);
  return ForwardingOutlet::publish(flagged_estimate_);
}

void ClockOutlet::publish_status(const PipelineStatus& status) {
  flagged_statuses_.assign(status.instruments.begin(), status.instruments.end());
  if (is_flagged()) {
    for (InstrumentStatus& instrument : flagged_statuses_) {
      instrument.reasons.add(Reason::kClockUnsynced);
    }
  }
  ForwardingOutlet::publish_status({status.stages, flagged_statuses_});
  is_status_due_ = false;
}

void ClockOutlet::look() {
  const std::int64_t now_ns = read_clocks().monotonic_ns;
  if (!has_other_hosts_ || now_ns < next_look_ns_) {
    return;
  }
  const bool is_first = next_look_ns_ == 0;
  next_look_ns_ = now_ns + kLookPeriod_ns;
  const ClockReference reference = read_kernel_clock().reference;
  if (reference != reference_) {
    log_reference(reference);
    is_status_due_ = !is_first;
  }
  reference_ = reference;
}

}  // namespace tubed
