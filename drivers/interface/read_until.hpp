// Reading with a deadline, for programs that have nothing else to do meanwhile.
#pragma once

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/source.hpp"

namespace tubed {

/// Reads and waits by turns until `source` (an open EmSource or ImageSource) gives something else than
/// kNothing, or `deadline` has come. A deadline in the past only looks.
template <typename Source, typename Frame>
ReadOutcome read_until(Source& source, Frame& frame, MonotonicTime deadline) noexcept {
  for (;;) {
    const ReadOutcome outcome = source.read(frame);
    if (outcome != ReadOutcome::kNothing || monotonic_now() >= deadline) {
      return outcome;
    }
    source.wait(deadline);
  }
}

}  // namespace tubed
