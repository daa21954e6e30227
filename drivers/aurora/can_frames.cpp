#include "drivers/aurora/can_frames.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "drivers/aurora/checksums.hpp"
#include "drivers/aurora/frame_counter.hpp"

namespace tubed::aurora {

namespace {

constexpr std::uint8_t kClassicSize = 8;
constexpr std::size_t kClassicCrcAt = 7;
constexpr std::uint8_t kFdSize = 48;
constexpr std::size_t kFdCrcAt = 44;
constexpr double kMicrometres = 1000;  // in 1 mm
constexpr double kUnitScale = 32767;   // 1 in 16 bit
constexpr double kIndicatorScale = 1e4;
constexpr std::int64_t kMax24 = 0x7F'FFFF;
constexpr std::int64_t kMax32 = 0x7FFF'FFFF;
constexpr double kLengthTolerance = 0.002;

/// Bits of the port status that a classic frame has, from its bit 0 up.
constexpr std::array<unsigned, 7> kFlagBits = {6, 7, 8, 12, 0, 4, 5};

std::uint8_t flags_of(PortStatus status) noexcept {
  unsigned flags = 0;
  for (std::size_t i = 0; i < kFlagBits.size(); ++i) {
    flags |= (status.bits >> kFlagBits[i] & 1U) << i;
  }
  return static_cast<std::uint8_t>(flags);
}

PortStatus status_of(std::uint8_t flags) noexcept {
  PortStatus status;
  for (std::size_t i = 0; i < kFlagBits.size(); ++i) {
    status.bits |= (static_cast<unsigned>(flags) >> i & 1U) << kFlagBits[i];
  }
  return status;
}

/// State to send: a pose only if it is one and fits.
CanCoilState state_of(const HandleReading& reading, std::int64_t largest) noexcept {
  if (reading.report == Report::kDisabled || reading.report == Report::kUnoccupied) {
    return CanCoilState::kDisabled;
  }
  const double reach_mm = static_cast<double>(largest) / kMicrometres;
  const bool fits = reading.p_em_mm.cwiseAbs().maxCoeff() < reach_mm;
  const bool sent = reading.report == Report::kValid && plausible_pose(reading) && fits;
  return sent ? CanCoilState::kValid : CanCoilState::kMissing;
}

std::int32_t fixed(double value, double scale, std::int64_t largest) noexcept {
  const double scaled = std::round(value * scale);
  const double limit = static_cast<double>(largest);
  return static_cast<std::int32_t>(std::clamp(scaled, -limit, limit));
}

std::uint16_t fixed_indicator(double indicator) noexcept {
  return static_cast<std::uint16_t>(std::clamp(std::round(indicator * kIndicatorScale), 0.0, 65535.0));
}

/// A pose of zeros stands for none.
HandleReading sent_pose(const HandleReading& reading, CanCoilState state) noexcept {
  if (state == CanCoilState::kValid) {
    return reading;
  }
  HandleReading none = reading;
  none.rotation = {0, 0, 0, 0};
  none.p_em_mm.setZero();
  none.indicator = 0;
  return none;
}

/// The layout has the image of z by the formula for quaternions of unit length, as it is: of one rounded to
/// four digits it comes out up to 1e-4 too long or short, and the receiver normalises it.
Eigen::Vector3d axis_as_sent(const Quaternion& rotation, CanCoilState state) noexcept {
  if (state != CanCoilState::kValid) {
    return Eigen::Vector3d::Zero();
  }
  const auto& [q0, qx, qy, qz] = rotation;
  return {2 * (qx * qz + q0 * qy), 2 * (qy * qz - q0 * qx), 1 - 2 * (qx * qx + qy * qy)};
}

/// Classic frame of 7 bytes and their check sum.
CanFrame seal_classic(CanFrame frame) noexcept {
  frame.size = kClassicSize;
  frame.bytes[kClassicCrcAt] = can_crc8(frame.id, Bytes(frame.bytes).first(kClassicCrcAt));
  return frame;
}

bool sealed_classic(const CanFrame& frame) noexcept {
  return frame.size == kClassicSize &&
         frame.bytes[kClassicCrcAt] == can_crc8(frame.id, Bytes(frame.bytes).first(kClassicCrcAt));
}

bool known(std::uint8_t state) noexcept { return state <= static_cast<std::uint8_t>(CanCoilState::kMissing); }

bool of_unit_length(double length) noexcept { return std::abs(length - 1) < kLengthTolerance; }

}  // namespace

Bytes CanFrame::payload() const noexcept {
  return Bytes(bytes).first(std::min<std::size_t>(size, bytes.size()));
}

bool is_fd_coil(std::uint32_t id, CanBase base) noexcept {
  const auto place = base.place_of(id);
  return place && *place >= CanBase::kFdCoilAt && *place < CanBase::kFdCoilAt + kMaxCanCoils;
}

bool is_classic_coil(std::uint32_t id, CanBase base) noexcept {
  const auto place = base.place_of(id);
  return place && *place >= CanBase::kClassicCoilAt;
}

std::uint8_t can_sequence(std::uint32_t frame) noexcept {
  return static_cast<std::uint8_t>(frame / kCountsPerMeasurement);
}

CanFrame pack_sync(const CanSync& sync, CanBase base) noexcept {
  CanFrame frame{base.sync(), kClassicSize, {}};
  ByteWriter writer(frame.bytes);
  writer.u32(sync.frame);
  writer.u32(sync.time_us);
  return frame;
}

CanFrame pack_follow_up(const CanFollowUp& follow_up, CanBase base) noexcept {
  CanFrame frame{base.follow_up(), kClassicSize, {}};
  ByteWriter writer(frame.bytes);
  writer.u32(follow_up.sent_us);
  writer.u8(follow_up.sequence);
  return seal_classic(frame);
}

CanFrame pack_status(const CanStatus& status, CanBase base) noexcept {
  CanFrame frame{base.status(), kClassicSize, {}};
  ByteWriter writer(frame.bytes);
  writer.u8(status.protocol);
  writer.u8(static_cast<std::uint8_t>(status.coil_count));
  writer.u16(status.system_status.bits);
  writer.u16(status.ports_present);
  writer.u8(status.gateway_error);
  return seal_classic(frame);
}

CanFrame pack_fd_coil(int coil, const HandleReading& reading, const CanSync& measurement,
                      SystemStatus system_status, std::uint32_t tool_serial_number, CanBase base) noexcept {
  CanFrame frame{base.fd_coil(coil), kFdSize, {}};
  const CanCoilState state = state_of(reading, kMax32);
  const HandleReading pose = sent_pose(reading, state);
  ByteWriter writer(frame.bytes);
  writer.u8(kCanProtocol);
  writer.u8(static_cast<std::uint8_t>(coil));
  writer.u8(static_cast<std::uint8_t>(state));
  writer.u8(can_sequence(measurement.frame));
  writer.u32(measurement.frame);
  writer.u32(measurement.time_us);
  for (int axis = 0; axis < 3; ++axis) {
    writer.i32(fixed(pose.p_em_mm[axis], kMicrometres, kMax32));
  }
  const Quaternion& q = pose.rotation;
  for (const double part : {q.q0, q.qx, q.qy, q.qz}) {
    writer.i16(fixed(part, kUnitScale, 32767));
  }
  writer.u32(reading.port_status.bits);
  writer.u16(fixed_indicator(pose.indicator));
  writer.u16(system_status.bits);
  writer.u32(tool_serial_number);
  writer.u32(can_crc32(frame.id, writer.written()));
  return frame;
}

std::array<CanFrame, kClassicParts> pack_classic_coil(int coil, const HandleReading& reading,
                                                      const CanSync& measurement, CanBase base) noexcept {
  const CanCoilState state = state_of(reading, kMax24);
  const HandleReading pose = sent_pose(reading, state);
  const auto binding = static_cast<std::uint8_t>(static_cast<unsigned>(state) << 4 |
                                                 (can_sequence(measurement.frame) & 0x0FU));
  const std::uint32_t id = base.classic_part(coil, 0);
  std::array<CanFrame, kClassicParts> frames{
      {{id, kClassicSize, {}}, {id + 1, kClassicSize, {}}, {id + 2, kClassicSize, {}}}};
  const auto position = [&pose](int axis) { return fixed(pose.p_em_mm[axis], kMicrometres, kMax24); };

  ByteWriter first(frames[0].bytes);
  first.i24(position(0));
  first.i24(position(1));
  first.u8(binding);

  ByteWriter second(frames[1].bytes);
  second.i24(position(2));
  second.u16(fixed_indicator(pose.indicator));
  second.u8(flags_of(reading.port_status));
  second.u8(binding);

  const Eigen::Vector3d axis_em = axis_as_sent(pose.rotation, state);
  ByteWriter third(frames[2].bytes);
  for (int axis = 0; axis < 3; ++axis) {
    third.i16(fixed(axis_em[axis], kUnitScale, 32767));
  }
  third.u8(binding);

  for (CanFrame& frame : frames) {
    frame = seal_classic(frame);
  }
  return frames;
}

std::optional<CanSync> unpack_sync(const CanFrame& frame, CanBase base) noexcept {
  if (frame.id != base.sync() || frame.size != kClassicSize) {
    return std::nullopt;
  }
  ByteReader bytes(frame.payload());
  CanSync sync;
  sync.frame = bytes.u32();
  sync.time_us = bytes.u32();
  return sync;
}

std::optional<CanFollowUp> unpack_follow_up(const CanFrame& frame, CanBase base) noexcept {
  if (frame.id != base.follow_up() || !sealed_classic(frame)) {
    return std::nullopt;
  }
  ByteReader bytes(frame.payload());
  CanFollowUp follow_up;
  follow_up.sent_us = bytes.u32();
  follow_up.sequence = bytes.u8();
  return follow_up;
}

std::optional<CanStatus> unpack_status(const CanFrame& frame, CanBase base) noexcept {
  if (frame.id != base.status() || !sealed_classic(frame)) {
    return std::nullopt;
  }
  ByteReader bytes(frame.payload());
  CanStatus status;
  status.protocol = bytes.u8();
  status.coil_count = bytes.u8();
  status.system_status.bits = bytes.u16();
  status.ports_present = bytes.u16();
  status.gateway_error = bytes.u8();
  return status.protocol == kCanProtocol ? std::optional(status) : std::nullopt;
}

std::optional<CanFdCoil> unpack_fd_coil(const CanFrame& frame, CanBase base) noexcept {
  if (!is_fd_coil(frame.id, base) || frame.size != kFdSize) {
    return std::nullopt;
  }
  const Bytes payload = frame.payload();
  if (ByteReader(payload.subspan(kFdCrcAt)).u32() != can_crc32(frame.id, payload.first(kFdCrcAt))) {
    return std::nullopt;
  }
  ByteReader bytes(payload);
  const std::uint8_t protocol = bytes.u8();
  CanFdCoil fd;
  fd.coil.coil = bytes.u8();
  const std::uint8_t state = bytes.u8();
  if (protocol != kCanProtocol || base.fd_coil(fd.coil.coil) != frame.id || !known(state)) {
    return std::nullopt;
  }
  fd.coil.state = static_cast<CanCoilState>(state);
  fd.sequence = bytes.u8();
  fd.measurement.frame = bytes.u32();
  fd.measurement.time_us = bytes.u32();
  HandleReading pose;
  for (int axis = 0; axis < 3; ++axis) {
    pose.p_em_mm[axis] = bytes.i32() / kMicrometres;
  }
  for (double* part : {&pose.rotation.q0, &pose.rotation.qx, &pose.rotation.qy, &pose.rotation.qz}) {
    *part = bytes.i16() / kUnitScale;
  }
  fd.coil.port_status.bits = bytes.u32();
  pose.indicator = bytes.u16() / kIndicatorScale;
  fd.system_status.bits = bytes.u16();
  fd.tool_serial_number = bytes.u32();
  if (fd.coil.state == CanCoilState::kValid) {
    if (!plausible_pose(pose)) {
      return std::nullopt;
    }
    fd.coil.p_em_mm = pose.p_em_mm;
    fd.coil.axis_em = coil_axis(pose.rotation);
    fd.coil.indicator = pose.indicator;
  }
  return fd;
}

std::optional<CanClassicPart> unpack_classic_part(const CanFrame& frame, CanBase base) noexcept {
  if (!is_classic_coil(frame.id, base) || !sealed_classic(frame)) {
    return std::nullopt;
  }
  const std::uint32_t offset = frame.id - base.classic_part(0, 0);
  const std::uint8_t binding = frame.bytes[6];
  const auto state = static_cast<std::uint8_t>(binding >> 4);
  if (offset % 4 >= kClassicParts || !known(state)) {
    return std::nullopt;
  }
  CanClassicPart part;
  part.coil = static_cast<int>(offset / 4);
  part.part = static_cast<int>(offset % 4);
  part.sequence = binding & 0x0F;
  part.state = static_cast<CanCoilState>(state);
  std::copy_n(frame.bytes.begin(), part.bytes.size(), part.bytes.begin());
  return part;
}

std::optional<CanCoil> join_classic_parts(const std::array<CanClassicPart, kClassicParts>& parts) noexcept {
  for (int i = 0; i < kClassicParts; ++i) {
    const CanClassicPart& part = parts[static_cast<std::size_t>(i)];
    if (part.part != i || part.coil != parts[0].coil || part.sequence != parts[0].sequence ||
        part.state != parts[0].state) {
      return std::nullopt;
    }
  }
  CanCoil coil;
  coil.coil = parts[0].coil;
  coil.state = parts[0].state;
  ByteReader first(parts[0].bytes);
  ByteReader second(parts[1].bytes);
  ByteReader third(parts[2].bytes);
  Eigen::Vector3d p_em_mm;
  p_em_mm.x() = first.i24() / kMicrometres;
  p_em_mm.y() = first.i24() / kMicrometres;
  p_em_mm.z() = second.i24() / kMicrometres;
  const double indicator = second.u16() / kIndicatorScale;
  coil.port_status = status_of(second.u8());
  if (coil.state != CanCoilState::kValid) {
    return coil;
  }
  Eigen::Vector3d axis_em;
  for (int axis = 0; axis < 3; ++axis) {
    axis_em[axis] = third.i16() / kUnitScale;
  }
  if (!of_unit_length(axis_em.norm())) {
    return std::nullopt;
  }
  coil.p_em_mm = p_em_mm;
  coil.axis_em = axis_em.normalized();
  coil.indicator = indicator;
  return coil;
}

CoilSample coil_sample(const CanCoil& coil) noexcept {
  const Report report = coil.state == CanCoilState::kValid      ? Report::kValid
                        : coil.state == CanCoilState::kDisabled ? Report::kDisabled
                                                                : Report::kMissing;
  CoilSample sample;
  sample.status = coil_status(report, coil.port_status);
  const bool usable = sample.status == CoilStatus::kOk || sample.status == CoilStatus::kOutOfVolume;
  if (usable && coil.state == CanCoilState::kValid) {
    sample.p_em_mm = coil.p_em_mm;
    sample.tangent_em = coil.axis_em;
    sample.indicator = coil.indicator;
  }
  return sample;
}

}  // namespace tubed::aurora
