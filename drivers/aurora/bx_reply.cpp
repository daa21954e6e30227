#include "drivers/aurora/bx_reply.hpp"

#include "drivers/aurora/checksums.hpp"

namespace tubed::aurora {

namespace {

constexpr std::uint8_t kValid = 0x01;
constexpr std::uint8_t kMissing = 0x02;
constexpr std::uint8_t kDisabled = 0x04;

/// Bytes of one handle; 0 when there is no such status.
std::size_t handle_size(std::uint8_t status) noexcept {
  switch (status) {
    case kValid:
      return 42;
    case kMissing:
      return 10;
    case kDisabled:
      return 2;
    default:
      return 0;
  }
}

/// Whether the handles' sizes add up to the body's. A header, a frame and two frames one behind the other all
/// run to a check sum of 0, so that a right one alone does not mean that body and length belong together.
bool adds_up(Bytes body) noexcept {
  if (body.empty() || body[0] > kMaxHandles) {
    return false;
  }
  std::size_t at = 1;
  for (int i = 0; i < body[0]; ++i) {
    const std::size_t size = at + 1 < body.size() ? handle_size(body[at + 1]) : 0;
    if (size == 0) {
      return false;
    }
    at += size;
  }
  return at + sizeof(std::uint16_t) == body.size();
}

bool read_handle(ByteReader& bytes, HandleReading& reading) noexcept {
  reading = HandleReading{};
  reading.handle = bytes.u8();
  const std::uint8_t status = bytes.u8();
  if (status == kDisabled) {
    reading.report = Report::kDisabled;
    return !bytes.overrun();
  }
  if (status != kValid && status != kMissing) {
    return false;
  }
  if (status == kValid) {
    reading.report = Report::kValid;
    Quaternion& q = reading.rotation;
    for (double* part : {&q.q0, &q.qx, &q.qy, &q.qz}) {
      *part = bytes.f32();
    }
    for (int axis = 0; axis < 3; ++axis) {
      reading.p_em_mm[axis] = bytes.f32();
    }
    reading.indicator = bytes.f32();
  }
  reading.port_status.bits = bytes.u32();
  reading.frame = bytes.u32();
  settle_pose(reading);
  return !bytes.overrun();
}

std::uint8_t status_byte(Report report) noexcept {
  if (report == Report::kDisabled || report == Report::kUnoccupied) {
    return kDisabled;
  }
  return report == Report::kValid ? kValid : kMissing;
}

void write_handle(const HandleReading& reading, ByteWriter& writer) noexcept {
  const std::uint8_t status = status_byte(reading.report);
  writer.u8(reading.handle);
  writer.u8(status);
  if (status == kDisabled) {
    return;
  }
  if (status == kValid) {
    const Quaternion& q = reading.rotation;
    for (const double number : {q.q0, q.qx, q.qy, q.qz, reading.p_em_mm.x(), reading.p_em_mm.y(),
                                reading.p_em_mm.z(), reading.indicator}) {
      writer.f32(number);
    }
  }
  writer.u32(reading.port_status.bits);
  writer.u32(reading.frame);
}

std::size_t body_size(const TrackingReply& reply) noexcept {
  std::size_t size = 3;
  for (const HandleReading& reading : reply.readings()) {
    size += handle_size(status_byte(reading.report));
  }
  return size;
}

}  // namespace

BxFrame frame_bx(Bytes bytes, Bytes& body) noexcept {
  if ((!bytes.empty() && bytes[0] != kBxStartLow) || (bytes.size() > 1 && bytes[1] != kBxStartHigh)) {
    return BxFrame::kBadStart;
  }
  if (bytes.size() < kBxHeaderSize) {
    return BxFrame::kNeedsMore;
  }
  const std::size_t length = ByteReader(bytes.subspan(2)).u16();
  if (crc16(bytes.first(kBxHeaderSize)) != 0 || length > kMaxBxBody) {
    return BxFrame::kBadHeader;
  }
  const std::size_t size = kBxHeaderSize + length + kBxCrcSize;
  if (bytes.size() < size) {
    return BxFrame::kNeedsMore;
  }
  if (crc16(bytes.subspan(kBxHeaderSize, length + kBxCrcSize)) != 0) {
    return BxFrame::kBadBody;
  }
  body = bytes.subspan(kBxHeaderSize, length);
  return adds_up(body) ? BxFrame::kComplete : BxFrame::kBadBody;
}

bool decode_bx(Bytes body, TrackingReply& reply) noexcept {
  ByteReader bytes(body);
  const int count = bytes.u8();
  if (count > kMaxHandles) {
    return false;
  }
  reply.handle_count = count;
  for (int i = 0; i < count; ++i) {
    if (!read_handle(bytes, reply.handles[static_cast<std::size_t>(i)])) {
      return false;
    }
  }
  reply.system_status.bits = bytes.u16();
  return !bytes.overrun() && bytes.left() == 0;
}

std::size_t encode_bx(const TrackingReply& reply, std::span<std::uint8_t> room) noexcept {
  ByteWriter writer(room);
  writer.u8(kBxStartLow);
  writer.u8(kBxStartHigh);
  writer.u16(static_cast<std::uint16_t>(body_size(reply)));
  writer.u16(crc16(writer.written()));
  writer.u8(static_cast<std::uint8_t>(reply.handle_count));
  for (const HandleReading& reading : reply.readings()) {
    write_handle(reading, writer);
  }
  writer.u16(reply.system_status.bits);
  if (writer.overrun()) {
    return 0;
  }
  writer.u16(crc16(writer.written().subspan(kBxHeaderSize)));
  return writer.overrun() ? 0 : writer.size();
}

}  // namespace tubed::aurora
