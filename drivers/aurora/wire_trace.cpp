#include "drivers/aurora/wire_trace.hpp"

#include <algorithm>
#include <cstring>

namespace tubed::aurora {

WireTrace::WireTrace(std::size_t capacity)
    : room_(std::max(capacity, 4 * kMaxRecord) / kAlignment * kAlignment) {}

void WireTrace::baud_rate(MonotonicTime time, int bits_per_second) noexcept {
  std::array<std::uint8_t, 4> number{};
  ByteWriter(number).u32(static_cast<std::uint32_t>(bits_per_second));
  add(time, WireEvent::kBaudRate, number);
}

void WireTrace::clear() noexcept {
  oldest_ = next_ = count_ = 0;
  forgotten_ = 0;
}

WireTrace::Header WireTrace::read_header(std::size_t at) const noexcept {
  Header header;
  std::memcpy(&header, room_.data() + at, sizeof(header));
  return header;
}

WireRecord WireTrace::record_at(std::size_t at) const noexcept {
  const Header header = read_header(at);
  WireRecord record;
  record.time = from_ns(header.time_ns);
  record.event = static_cast<WireEvent>(header.event);
  record.bytes = Bytes(room_).subspan(at + sizeof(Header), header.size);
  if (record.event == WireEvent::kBaudRate) {
    record.bits_per_second = static_cast<int>(ByteReader(record.bytes).u32());
    record.bytes = {};
  }
  return record;
}

void WireTrace::add_pieces(MonotonicTime time, WireEvent event, Bytes bytes) noexcept {
  while (!bytes.empty()) {
    const std::size_t size = std::min(bytes.size(), kMaxRecord);
    add(time, event, bytes.first(size));
    bytes = bytes.subspan(size);
  }
}

void WireTrace::add(MonotonicTime time, WireEvent event, Bytes bytes) noexcept {
  make_room(footprint(bytes.size()));
  const Header header{
      to_ns(time), static_cast<std::uint32_t>(bytes.size()), static_cast<std::uint8_t>(event), 0, {}};
  std::memcpy(room_.data() + next_, &header, sizeof(header));
  if (!bytes.empty()) {
    std::memcpy(room_.data() + next_ + sizeof(header), bytes.data(), bytes.size());
  }
  next_ += footprint(bytes.size());
  next_ = next_ == room_.size() ? 0 : next_;
  ++count_;
}

// After it there are `size` bytes free in one piece at next_. Records begin at multiples of kAlignment, so
// that a header always fits before the end of the room.
void WireTrace::make_room(std::size_t size) noexcept {
  if (room_.size() - next_ < size) {
    while (count_ > 0 && oldest_ >= next_) {
      forget_oldest();
      if (oldest_ == 0) {
        break;
      }
    }
    const Header filler{0, 0, 0, kFiller, {}};
    std::memcpy(room_.data() + next_, &filler, sizeof(filler));
    next_ = 0;
  }
  while (count_ > 0 && oldest_ >= next_ && oldest_ - next_ < size) {
    forget_oldest();
  }
  if (count_ == 0) {
    oldest_ = next_;
  }
}

void WireTrace::forget_oldest() noexcept {
  oldest_ += footprint(read_header(oldest_).size);
  --count_;
  ++forgotten_;
  if (oldest_ == room_.size() || (count_ > 0 && read_header(oldest_).size_class == kFiller)) {
    oldest_ = 0;
  }
}

}  // namespace tubed::aurora
