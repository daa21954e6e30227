#include "drivers/aurora/tx_reply.hpp"

#include <cmath>

#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora {

namespace {

constexpr double kRotationUnits = 1e4;  // units of the last digit in 1
constexpr double kPositionUnits = 1e2;  // in 1 mm
constexpr std::size_t kRotationDigits = 5;
constexpr std::size_t kPositionDigits = 6;
constexpr std::string_view kMissing = "MISSING";
constexpr std::string_view kDisabled = "DISABLED";
constexpr std::string_view kUnoccupied = "UNOCCUPIED";
constexpr std::string_view kLineFeed = "\n";

void read_pose(TextReader& text, HandleReading& reading) noexcept {
  const auto rotation = [&text] { return text.decimal(kRotationDigits) / kRotationUnits; };
  const auto position = [&text] { return text.decimal(kPositionDigits) / kPositionUnits; };
  for (double* q : {&reading.rotation.q0, &reading.rotation.qx, &reading.rotation.qy, &reading.rotation.qz}) {
    *q = rotation();
  }
  for (int axis = 0; axis < 3; ++axis) {
    reading.p_em_mm[axis] = position();
  }
  reading.indicator = rotation();
}

void read_status(TextReader& text, HandleReading& reading) noexcept {
  reading.port_status.bits = text.hex(8);
  reading.frame = text.hex(8);
}

/// Passes over status and frame of a handle without data, should they be there: they say nothing.
void skip_status(TextReader& text) noexcept {
  TextReader ahead = text;
  ahead.hex(8);
  ahead.hex(8);
  if (!ahead.broken()) {
    text = ahead;
  }
}

HandleReading read_handle(TextReader& text) noexcept {
  HandleReading reading;
  reading.handle = static_cast<std::uint8_t>(text.hex(2));
  if (text.skip(kDisabled)) {
    reading.report = Report::kDisabled;
  } else if (text.skip(kUnoccupied)) {
    reading.report = Report::kUnoccupied;
  }
  if (reading.report != Report::kMissing) {
    skip_status(text);
    return reading;
  }
  if (!text.skip(kMissing)) {
    reading.report = Report::kValid;
    read_pose(text, reading);
  }
  read_status(text, reading);
  settle_pose(reading);
  return reading;
}

class NumberWriter {
 public:
  explicit NumberWriter(ByteWriter& writer) noexcept : writer_(writer) {}
  void put(double value, double units, std::size_t digits) noexcept {
    const double scaled = std::round(value * units);
    if (!(std::abs(scaled) < std::pow(10.0, static_cast<double>(digits)))) {
      fits_ = false;
      return;
    }
    writer_.decimal(static_cast<std::int64_t>(scaled), static_cast<int>(digits));
  }
  [[nodiscard]] bool fits() const noexcept { return fits_; }

 private:
  ByteWriter& writer_;
  bool fits_ = true;
};

bool write_pose(const HandleReading& reading, ByteWriter& writer) noexcept {
  NumberWriter numbers(writer);
  const Quaternion& q = reading.rotation;
  for (const double part : {q.q0, q.qx, q.qy, q.qz}) {
    numbers.put(part, kRotationUnits, kRotationDigits);
  }
  for (int axis = 0; axis < 3; ++axis) {
    numbers.put(reading.p_em_mm[axis], kPositionUnits, kPositionDigits);
  }
  numbers.put(reading.indicator, kRotationUnits, kRotationDigits);
  return numbers.fits();
}

bool write_handle(const HandleReading& reading, ByteWriter& writer) noexcept {
  writer.hex(reading.handle, 2);
  bool fits = true;
  switch (reading.report) {
    case Report::kDisabled:
      writer.text(kDisabled);
      break;
    case Report::kUnoccupied:
      writer.text(kUnoccupied);
      break;
    case Report::kValid:
      fits = write_pose(reading, writer);
      break;
    case Report::kMissing:
    case Report::kImplausible:
      writer.text(kMissing);
      break;
  }
  if (reading.report != Report::kDisabled && reading.report != Report::kUnoccupied) {
    writer.hex(reading.port_status.bits, 8);
    writer.hex(reading.frame, 8);
  }
  writer.text(kLineFeed);
  return fits;
}

}  // namespace

bool decode_tx(std::string_view payload, TrackingReply& reply) noexcept {
  TextReader text(payload);
  const std::uint32_t count = text.hex(2);
  if (text.broken() || count > static_cast<std::uint32_t>(kMaxHandles)) {
    return false;
  }
  reply.handle_count = static_cast<int>(count);
  for (int i = 0; i < reply.handle_count; ++i) {
    reply.handles[static_cast<std::size_t>(i)] = read_handle(text);
    if (!text.skip(kLineFeed) && i + 1 < reply.handle_count) {
      return false;
    }
  }
  reply.system_status.bits = static_cast<std::uint16_t>(text.hex(4));
  text.skip(kLineFeed);
  return !text.broken() && text.left() == 0;
}

std::size_t encode_tx(const TrackingReply& reply, std::span<std::uint8_t> room) noexcept {
  ByteWriter writer(room);
  writer.hex(static_cast<std::uint32_t>(reply.handle_count), 2);
  for (const HandleReading& reading : reply.readings()) {
    if (!write_handle(reading, writer)) {
      return 0;
    }
  }
  writer.hex(reply.system_status.bits, 4);
  return writer.overrun() ? 0 : writer.size();
}

}  // namespace tubed::aurora
