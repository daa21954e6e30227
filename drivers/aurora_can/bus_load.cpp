#include "drivers/aurora_can/bus_load.hpp"

namespace tubed {

namespace {

constexpr int kBitsPerByte = 8;
/// Acknowledgement and its delimiter, end of frame, pause: never stuffed.
constexpr int kTail = 1 + 1 + 7 + 3;
constexpr int kCrcDelimiter = 1;

/// A stuff bit follows five equal bits and counts for the next five: after the first, one in four.
constexpr int most_stuff_bits(int bits) noexcept { return (bits - 1) / 4; }

CanFrameBits classic(int size) noexcept {
  constexpr int kHead = 1 + 11 + 1 + 1 + 1 + 4;  // start, identifier, RTR, IDE, r0, DLC
  constexpr int kCrc = 15;
  const int stuffed = kHead + kBitsPerByte * size + kCrc;
  return {stuffed + most_stuff_bits(stuffed) + kCrcDelimiter + kTail, 0};
}

CanFrameBits fd(int size) noexcept {
  constexpr int kArbitration = 1 + 11 + 1 + 1 + 1 + 1 + 1;  // start, identifier, RRS, IDE, FDF, res, BRS
  constexpr int kControl = 1 + 4;                           // ESI, DLC
  constexpr int kStuffCount = 4;
  constexpr int kLargestWithShortCrc = 16;  // bytes
  const int crc = kStuffCount + (size <= kLargestWithShortCrc ? 17 : 21);
  const int fixed_stuff = (crc + 3) / 4;  // before the first bit of it, and after every fourth
  const int data = kControl + kBitsPerByte * size;
  const int in_arbitration = most_stuff_bits(kArbitration);
  const int in_data = most_stuff_bits(kArbitration + data) - in_arbitration;
  return {kArbitration + in_arbitration + kTail, data + in_data + crc + fixed_stuff + kCrcDelimiter};
}

}  // namespace

double CanFrameBits::seconds(const CanRates& rates) const noexcept {
  return nominal / rates.nominal_bits_per_second + data / rates.data_bits_per_second;
}

CanFrameBits most_frame_bits(int size) noexcept { return size <= kBitsPerByte ? classic(size) : fd(size); }

double bus_seconds(std::span<const aurora::CanFrame> frames, const CanRates& rates) noexcept {
  double seconds = 0;
  for (const aurora::CanFrame& frame : frames) {
    seconds += most_frame_bits(frame.size).seconds(rates);
  }
  return seconds;
}

}  // namespace tubed
