// The bytes on the wire between host and device: each takes ten bits at its rate, and a receiver at another
// rate hears noise.
// Used by SecondAurora only, in its thread.
#pragma once

#include <cstdint>
#include <deque>
#include <span>

#include "tests/second_aurora/mischief.hpp"
#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

// Of start bit, eight data bits and stop bit.
std::int64_t byte_time_ns(int baud);
// Within 3 %, the tolerance of a UART.
bool same_rate(int baud, int other_baud);

// What a receiver makes of a sender's byte: the byte at the same rate, otherwise noise: several
// bytes when the receiver is faster, one now and then when it is slower.
class Ear {
 public:
  explicit Ear(Mischief& mischief) : mischief_(mischief) {}
  void hear(std::uint8_t byte, int sent_baud, int own_baud, Bytes& out);

 private:
  Mischief& mischief_;
  double owed_bytes_ = 0;
};

// From the host: bytes arrive one after the other.
class LineIn {
 public:
  struct Arrival {
    std::int64_t time_ns = 0;
    std::uint8_t byte = 0;
    int host_baud = 0;
  };
  void send(std::span<const std::uint8_t> bytes, int host_baud, std::int64_t now_ns);
  // The host gives up what it has not sent yet.
  void cut(std::int64_t now_ns);
  bool empty() const { return arrivals_.empty(); }
  const Arrival& front() const { return arrivals_.front(); }
  void pop() { arrivals_.pop_front(); }
  // When the first CR is in, or a byte at another rate, which may be heard as one; otherwise the last byte.
  // INT64_MAX when nothing is on its way.
  std::int64_t next_line_ns(int own_baud) const;

 private:
  std::deque<Arrival> arrivals_;
  std::int64_t free_at_ns_ = INT64_MIN;
};

// To the host. An adapter with a latency timer hands bytes over in packets: when 62 are in or at the timer's
// next tick.
class LineOut {
 public:
  struct Departure {
    std::int64_t left_ns = 0;         // the whole byte is on the wire
    std::int64_t handed_over_ns = 0;  // the host can read it
    std::uint8_t byte = 0;
    int baud = 0;
  };
  explicit LineOut(std::int64_t latency_timer_ns) : latency_timer_ns_(latency_timer_ns) {}
  // Sends from `from_ns` on, or when what was sent before has left.
  void send(std::span<const std::uint8_t> bytes, int baud, std::int64_t from_ns);
  // When the last byte has left.
  std::int64_t free_at_ns() const { return free_at_ns_; }
  // Forgets what has not left yet.
  void cut(std::int64_t now_ns);
  bool empty() const { return departures_.empty(); }
  const Departure& front() const { return departures_.front(); }
  void pop() { departures_.pop_front(); }
  // Forgets what would be handed over in [from, until).
  void lose(std::int64_t from_ns, std::int64_t until_ns);

 private:
  std::int64_t latency_timer_ns_;
  std::deque<Departure> departures_;
  std::int64_t free_at_ns_ = INT64_MIN, packet_ends_ns_ = INT64_MIN;
  std::size_t in_packet_ = 0;  // at the end of departures_, or handed over already
};

}  // namespace tubed::second_aurora
