// Whether the host's real-time clock can be compared with other hosts' clocks.
#pragma once

#include <cstdint>

namespace tubed {

enum class ClockReference {
  kFollowed,  ///< NTP, PTP or another reference disciplines CLOCK_REALTIME
  kNone,      ///< it runs freely, or has not settled yet
  kUnknown,   ///< the kernel refused to tell, as ProtectClock= of systemd makes it
};

struct KernelClock {
  ClockReference reference = ClockReference::kUnknown;
  std::int64_t max_error_ns = 0;  ///< the kernel's bound of the clock's error; 0 with kUnknown
};

/// What adjtimex(2) answered: its return value, and `status` and `maxerror` (us) of struct timex.
KernelClock judge_kernel_clock(int answer, int status, long max_error_us);

/// Asks the kernel, which needs no privilege and sets nothing. Any thread; one system call.
KernelClock read_kernel_clock();

}  // namespace tubed
