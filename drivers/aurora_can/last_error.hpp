// Why a call of the system failed.
#pragma once

#include <cerrno>

namespace tubed {

/// errno; EIO where the call has left none, so that it never reads as success.
inline int last_error() noexcept { return errno == 0 ? EIO : errno; }

}  // namespace tubed
