// Replies drawn at random from a fixed seed, of values with as many digits as text has, and their
// comparison.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/reply.hpp"
#include "drivers/aurora/tx_reply.hpp"

namespace tubed::aurora {

class DrawnReplies {
 public:
  explicit DrawnReplies(std::uint32_t seed) : random_(seed) {}

  std::uint32_t below(std::uint32_t limit) {
    return std::uniform_int_distribution<std::uint32_t>(0, limit - 1)(random_);
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(below(256)); }

  /// A reply of `count` handles 0A, 0B, ... of one measurement.
  TrackingReply reply(int count, std::uint32_t frame) {
    TrackingReply reply;
    reply.handle_count = count;
    for (int i = 0; i < count; ++i) {
      auto& reading = reply.handles[static_cast<std::size_t>(i)];
      reading = any_reading(frame);
      reading.handle = static_cast<std::uint8_t>(0x0A + i);
    }
    reply.system_status.bits = static_cast<std::uint16_t>(below(0x800));
    return reply;
  }

 private:
  HandleReading any_reading(std::uint32_t frame) {
    HandleReading reading;
    switch (below(8)) {
      case 0:
        reading.report = Report::kMissing;
        break;
      case 1:
        reading.report = Report::kDisabled;
        return reading;
      default:
        reading.report = Report::kValid;
        draw_pose(reading);
    }
    reading.port_status.bits = 0x3F | below(4) << 6;
    reading.frame = frame;
    return reading;
  }

  void draw_pose(HandleReading& reading) {
    std::uniform_real_distribution<double> angle(0, 3.0);
    std::uniform_real_distribution<double> position(-300, 300);
    const double half = angle(random_) / 2;
    const double around = 2 * angle(random_);
    const auto to_field = [](double value, double units) { return std::round(value * units) / units; };
    reading.rotation = {to_field(std::cos(half), 1e4), to_field(std::sin(half) * std::cos(around), 1e4),
                        to_field(std::sin(half) * std::sin(around), 1e4), 0};
    reading.p_em_mm = {to_field(position(random_), 100), to_field(position(random_), 100),
                       to_field(position(random_), 100)};
    reading.indicator = to_field(below(2000) / 1e4, 1e4);
  }

  std::mt19937 random_;
};

/// What single precision leaves of 300 mm, and of anything smaller.
inline constexpr double kRounding = 2e-5;

inline bool same_reading(const HandleReading& a, const HandleReading& b, double tolerance) {
  const auto near = [tolerance](double x, double y) {
    return std::abs(x - y) <= tolerance || (std::isnan(x) && std::isnan(y));
  };
  return a.handle == b.handle && a.report == b.report && a.port_status.bits == b.port_status.bits &&
         a.frame == b.frame && near(a.rotation.q0, b.rotation.q0) && near(a.rotation.qx, b.rotation.qx) &&
         near(a.rotation.qy, b.rotation.qy) && near(a.rotation.qz, b.rotation.qz) &&
         near(a.p_em_mm.x(), b.p_em_mm.x()) && near(a.p_em_mm.y(), b.p_em_mm.y()) &&
         near(a.p_em_mm.z(), b.p_em_mm.z()) && near(a.indicator, b.indicator);
}

inline bool same_reply(const TrackingReply& a, const TrackingReply& b, double tolerance = kRounding) {
  bool same = a.handle_count == b.handle_count && a.system_status.bits == b.system_status.bits;
  for (std::size_t i = 0; same && i < a.readings().size(); ++i) {
    same = same_reading(a.readings()[i], b.readings()[i], tolerance);
  }
  return same;
}

inline std::vector<std::uint8_t> as_bx(const TrackingReply& reply) {
  std::vector<std::uint8_t> room(kMaxBxFrame);
  room.resize(encode_bx(reply, room));
  return room;
}

/// A whole TX reply, check sum and carriage return with it.
inline std::vector<std::uint8_t> as_tx(const TrackingReply& reply) {
  std::vector<std::uint8_t> payload(4096);
  payload.resize(encode_tx(reply, payload));
  std::vector<std::uint8_t> room(payload.size() + 5);
  room.resize(encode_text_reply(as_text(payload), room));
  return room;
}

}  // namespace tubed::aurora
