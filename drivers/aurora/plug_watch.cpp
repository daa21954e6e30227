#include "drivers/aurora/plug_watch.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

constexpr std::chrono::seconds kFirstWait{2};
constexpr std::chrono::seconds kLastWait{300};

}  // namespace

bool PlugWatch::look(const Sight& sight, MonotonicTime now) noexcept {
  const bool occupied = sight.status.port_became_occupied();
  became_occupied_ |= occupied && !occupied_bit_ && occupied_known_;
  occupied_bit_ = occupied;
  occupied_known_ = true;
  if (!sight.coil_absent) {
    not_before_ = {};
    wait_ = kFirstWait;
    became_occupied_ = false;
    return false;
  }
  if (!(became_occupied_ || sight.newcomer) || now < not_before_) {
    return false;
  }
  not_before_ = now + wait_;
  wait_ = std::min<std::chrono::nanoseconds>(2 * wait_, kLastWait);
  became_occupied_ = false;
  return true;
}

}  // namespace tubed::aurora
