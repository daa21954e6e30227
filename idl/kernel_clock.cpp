#include "idl/kernel_clock.hpp"

#include <sys/timex.h>

namespace tubed {

KernelClock judge_kernel_clock(int answer, int status, long max_error_us) {
  if (answer < 0) {
    return {};
  }
  const bool is_followed = answer != TIME_ERROR && (status & STA_UNSYNC) == 0;
  return {.reference = is_followed ? ClockReference::kFollowed : ClockReference::kNone,
          .max_error_ns = std::int64_t{max_error_us} * 1000};
}

KernelClock read_kernel_clock() {
  timex state{};
  const int answer = adjtimex(&state);
  return judge_kernel_clock(answer, state.status, state.maxerror);
}

}  // namespace tubed
