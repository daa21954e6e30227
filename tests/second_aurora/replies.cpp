#include "tests/second_aurora/replies.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tubed::second_aurora {

namespace {

constexpr std::uint32_t kOutOfVolume = 1u << 6;
constexpr std::uint32_t kBrokenCoil = 1u << 8;

// One handle as both forms report it.
struct Reported {
  bool valid = false;
  Pose pose;
  std::uint32_t port_status = 0;
  std::uint32_t frame = 0;
};

Reported report(const TrackingReply& reply, const Handle& handle) {
  Reported reported;
  reported.port_status = 0x31u | reply.extra_port_status;
  if (reply.measurement == nullptr) {
    return reported;
  }
  reported.frame = reply.measurement->frame;
  for (const CoilTruth& coil : reply.measurement->coils) {
    if (coil.port != handle.port || coil.channel != handle.channel) {
      continue;
    }
    const bool outside = coil.state == CoilState::OutOfVolume || coil.state == CoilState::OutOfVolumeMissing;
    reported.valid = coil.state == CoilState::Valid ||
                     (coil.state == CoilState::OutOfVolume && reply.reports_out_of_volume);
    reported.pose = coil.pose;
    reported.port_status |=
        (outside ? kOutOfVolume : 0) | (coil.state == CoilState::Broken ? kBrokenCoil : 0);
  }
  return reported;
}

// Sign and `digits` digits, the last of which is worth `unit`.
std::string fixed_point(double value, double unit, int digits) {
  const double most = std::pow(10.0, digits) - 1;
  const long long rounded = std::llround(std::clamp(value / unit, -most, most));
  std::string text = std::to_string(rounded < 0 ? -rounded : rounded);
  text.insert(0, static_cast<std::size_t>(digits) - text.size(), '0');
  return (rounded < 0 ? "-" : "+") + text;
}

void append_le(Bytes& bytes, std::uint32_t value, int count) {
  for (int i = 0; i < count; ++i, value >>= 8) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
  }
}

}  // namespace

std::string in_text(const TrackingReply& reply) {
  std::string text = hex(reply.handles.size(), 2);
  for (const Handle* handle : reply.handles) {
    text += hex(static_cast<unsigned>(handle->number), 2);
    if (!handle->enabled) {
      text += handle->occupied || handle->lost_while_tracking ? "DISABLED\n" : "UNOCCUPIED\n";
      continue;
    }
    const Reported reported = report(reply, *handle);
    if (reported.valid) {
      const Pose& pose = reported.pose;
      for (const double component : {pose.q0, pose.qx, pose.qy, pose.qz}) {
        text += fixed_point(component, 1e-4, 5);
      }
      for (const double component_mm : {pose.x_mm, pose.y_mm, pose.z_mm}) {
        text += fixed_point(component_mm, 0.01, 6);
      }
      text += fixed_point(pose.indicator, 1e-4, 5);
    } else {
      text += "MISSING";
    }
    text += hex(reported.port_status, 8) + hex(reported.frame, 8) + "\n";
  }
  return text + hex(reply.system_status, 4);
}

Bytes in_binary(const TrackingReply& reply) {
  Bytes body{static_cast<std::uint8_t>(reply.handles.size())};
  for (const Handle* handle : reply.handles) {
    body.push_back(static_cast<std::uint8_t>(handle->number));
    if (!handle->enabled) {
      body.push_back(0x04);
      continue;
    }
    const Reported reported = report(reply, *handle);
    body.push_back(reported.valid ? 0x01 : 0x02);
    if (reported.valid) {
      const Pose& pose = reported.pose;
      for (const double number :
           {pose.q0, pose.qx, pose.qy, pose.qz, pose.x_mm, pose.y_mm, pose.z_mm, pose.indicator}) {
        append_le(body, std::bit_cast<std::uint32_t>(static_cast<float>(number)), 4);
      }
    }
    append_le(body, reported.port_status, 4);
    append_le(body, reported.frame, 4);
  }
  append_le(body, reply.system_status, 2);
  return binary_framed(body);
}

Bytes binary_framed(const Bytes& body) {
  Bytes bytes{0xC4, 0xA5};
  append_le(bytes, static_cast<std::uint32_t>(body.size()), 2);
  append_le(bytes, crc16(bytes), 2);
  bytes.insert(bytes.end(), body.begin(), body.end());
  append_le(bytes, crc16(body), 2);
  return bytes;
}

}  // namespace tubed::second_aurora
