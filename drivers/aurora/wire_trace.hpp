// The last minutes of what went over a serial line, always kept: when something goes wrong it is written as a
// wire log (wire_log.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/aurora/bytes.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

enum class WireEvent : std::uint8_t {
  kSent,      ///< bytes from the host to the tracker
  kReceived,  ///< bytes from the tracker to the host
  kBaudRate,  ///< the host's port has been set to another rate
  kBreak,     ///< the host has sent a serial break
  kNote,      ///< not on the wire: what the host thought of it, as text
};

/// One thing that happened. The bytes are looked at where they are kept.
struct WireRecord {
  MonotonicTime time{};
  WireEvent event = WireEvent::kNote;
  Bytes bytes;              ///< of kSent and kReceived; the text of kNote
  int bits_per_second = 0;  ///< of kBaudRate
};

/// A ring of fixed size: the newest records push out the oldest. One thread. Allocates when it is made, never
/// again.
class WireTrace {
 public:
  /// Records longer than this are kept as several.
  static constexpr std::size_t kMaxRecord = 1024;

  /// `capacity`: bytes kept, 16 a record included; at least 4 kMaxRecord.
  explicit WireTrace(std::size_t capacity);

  void sent(MonotonicTime time, Bytes bytes) noexcept { add_pieces(time, WireEvent::kSent, bytes); }
  void received(MonotonicTime time, Bytes bytes) noexcept { add_pieces(time, WireEvent::kReceived, bytes); }
  void baud_rate(MonotonicTime time, int bits_per_second) noexcept;
  void serial_break(MonotonicTime time) noexcept { add(time, WireEvent::kBreak, {}); }
  void note(MonotonicTime time, std::string_view text) noexcept {
    add_pieces(time, WireEvent::kNote, as_bytes(text));
  }
  void clear() noexcept;

  /// Calls `look(record)` for every record kept, oldest first.
  template <typename Look>
  void each(Look look) const {
    std::size_t at = oldest_;
    for (std::size_t i = 0; i < count_; ++i) {
      at = read_header(at).size_class == kFiller ? 0 : at;
      look(record_at(at));
      at += footprint(read_header(at).size);
      at = at == room_.size() ? 0 : at;
    }
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  /// Records that newer ones have pushed out.
  [[nodiscard]] std::uint64_t forgotten() const noexcept { return forgotten_; }

 private:
  static constexpr std::uint8_t kFiller = 0xFF;  ///< the rest of the room is not used
  static constexpr std::size_t kAlignment = 16;

  struct Header {
    std::int64_t time_ns;
    std::uint32_t size;
    std::uint8_t event;
    std::uint8_t size_class;
    std::uint8_t unused[2];
  };
  static_assert(sizeof(Header) == kAlignment);

  static std::size_t footprint(std::size_t size) noexcept {
    return sizeof(Header) + (size + kAlignment - 1) / kAlignment * kAlignment;
  }
  [[nodiscard]] Header read_header(std::size_t at) const noexcept;
  [[nodiscard]] WireRecord record_at(std::size_t at) const noexcept;
  void add_pieces(MonotonicTime time, WireEvent event, Bytes bytes) noexcept;
  void add(MonotonicTime time, WireEvent event, Bytes bytes) noexcept;
  void make_room(std::size_t size) noexcept;
  void forget_oldest() noexcept;

  std::vector<std::uint8_t> room_;
  std::size_t oldest_ = 0;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  std::uint64_t forgotten_ = 0;
};

}  // namespace tubed::aurora
