// A broken precondition is a bug of the caller: say which and abort, in release builds too.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace tubed {

/// Aborts with `what` on stderr when `holds` is false. Never allocates. Not for what the outside world can
/// cause.
inline void require(bool holds, const char* what) {
  if (holds) [[likely]] {
    return;
  }
  std::fputs(what, stderr);
  std::fputc('\n', stderr);
  std::abort();
}

}  // namespace tubed
