#include "tests/second_aurora/serial_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tubed::second_aurora {

namespace {

constexpr std::size_t kPacketBytes = 62;
constexpr double kMaxNoisePerByte = 5;

std::int64_t next_tick_ns(std::int64_t time_ns, std::int64_t period_ns) {
  const std::int64_t past_ns = ((time_ns % period_ns) + period_ns) % period_ns;
  return past_ns == 0 ? time_ns : time_ns + period_ns - past_ns;
}

}  // namespace

std::int64_t byte_time_ns(int baud) { return std::llround(10e9 / baud); }

bool same_rate(int baud, int other_baud) { return std::abs(baud - other_baud) <= other_baud / 33; }

void Ear::hear(std::uint8_t byte, int sent_baud, int own_baud, Bytes& out) {
  if (same_rate(sent_baud, own_baud)) {
    owed_bytes_ = 0;
    out.push_back(byte);
    return;
  }
  for (owed_bytes_ += std::min(kMaxNoisePerByte, static_cast<double>(own_baud) / sent_baud); owed_bytes_ >= 1;
       owed_bytes_ -= 1) {
    out.push_back(mischief_.noise());
  }
}

void LineIn::send(std::span<const std::uint8_t> bytes, int host_baud, std::int64_t now_ns) {
  free_at_ns_ = std::max(free_at_ns_, now_ns);
  for (const std::uint8_t byte : bytes) {
    free_at_ns_ += byte_time_ns(host_baud);
    arrivals_.push_back({free_at_ns_, byte, host_baud});
  }
}

void LineIn::cut(std::int64_t now_ns) {
  arrivals_.clear();
  free_at_ns_ = now_ns;
}

std::int64_t LineIn::next_line_ns(int own_baud) const {
  if (arrivals_.empty()) {
    return INT64_MAX;
  }
  const auto line_end = std::find_if(arrivals_.begin(), arrivals_.end(), [own_baud](const Arrival& arrival) {
    return arrival.byte == '\r' || !same_rate(arrival.host_baud, own_baud);
  });
  return line_end == arrivals_.end() ? arrivals_.back().time_ns : line_end->time_ns;
}

void LineOut::send(std::span<const std::uint8_t> bytes, int baud, std::int64_t from_ns) {
  free_at_ns_ = std::max(free_at_ns_, from_ns);
  for (const std::uint8_t byte : bytes) {
    free_at_ns_ += byte_time_ns(baud);
    departures_.push_back({free_at_ns_, free_at_ns_, byte, baud});
    if (latency_timer_ns_ == 0) {
      continue;
    }
    if (in_packet_ == 0 || free_at_ns_ > packet_ends_ns_) {
      packet_ends_ns_ = next_tick_ns(free_at_ns_, latency_timer_ns_);
      in_packet_ = 0;
    }
    departures_.back().handed_over_ns = packet_ends_ns_;
    if (++in_packet_ == kPacketBytes) {
      for (auto part = departures_.rbegin(); in_packet_ > 0 && part != departures_.rend();
           ++part, --in_packet_) {
        part->handed_over_ns = free_at_ns_;
      }
      in_packet_ = 0;
    }
  }
}

void LineOut::cut(std::int64_t now_ns) {
  while (!departures_.empty() && departures_.back().left_ns > now_ns) {
    departures_.pop_back();
  }
  free_at_ns_ = std::min(free_at_ns_, now_ns);
  in_packet_ = 0;
}

void LineOut::lose(std::int64_t from_ns, std::int64_t until_ns) {
  std::erase_if(departures_, [from_ns, until_ns](const Departure& departure) {
    return departure.handed_over_ns >= from_ns && departure.handed_over_ns < until_ns;
  });
}

}  // namespace tubed::second_aurora
