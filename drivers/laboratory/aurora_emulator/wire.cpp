#include "drivers/laboratory/aurora_emulator/wire.hpp"

#include <algorithm>
#include <utility>

namespace tubed::aurora::emulator {

std::chrono::nanoseconds byte_time(const LinkParameters& link) noexcept {
  const int bits = 1 + (link.data_bits == DataBits::k8 ? 8 : 7) + (link.parity == Parity::kNone ? 0 : 1) +
                   (link.stop_bits == StopBits::k1 ? 1 : 2);
  return std::chrono::nanoseconds(1'000'000'000LL * bits / bits_per_second(link.rate));
}

MonotonicTime Wire::send(std::vector<std::uint8_t> bytes, MonotonicTime start) {
  Sending sending;
  sending.bytes = std::move(bytes);
  sending.start = std::max(start, free_);
  sending.each = byte_time(link);
  sending.mask = link.data_bits == DataBits::k8 ? 0xFF : 0x7F;
  sending.bits_per_second = bits_per_second(link.rate);
  free_ = sending.start + static_cast<std::int64_t>(sending.bytes.size()) * sending.each;
  if (!sending.bytes.empty()) {
    sending_.push_back(std::move(sending));
  }
  return free_;
}

void Wire::take(MonotonicTime now, int host_bits_per_second, std::vector<std::uint8_t>& out) {
  while (!sending_.empty()) {
    Sending& first = sending_.front();
    while (first.sent < first.bytes.size() && first.over(first.sent) <= now) {
      const std::uint8_t byte = first.bytes[first.sent++] & first.mask;
      out.push_back(host_bits_per_second == first.bits_per_second ? byte
                                                                  : static_cast<std::uint8_t>(random_()));
    }
    if (first.sent < first.bytes.size()) {
      return;
    }
    sending_.pop_front();
  }
}

MonotonicTime Wire::next_byte() const noexcept {
  return sending_.empty() ? MonotonicTime::max() : sending_.front().over(sending_.front().sent);
}

std::uint8_t Wire::hear(std::uint8_t byte, int host_bits_per_second) {
  return host_bits_per_second == bits_per_second(link.rate) ? byte : static_cast<std::uint8_t>(random_());
}

}  // namespace tubed::aurora::emulator
