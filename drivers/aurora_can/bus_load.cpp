#include "drivers/aurora_can/bus_load.hpp"

namespace tubed {

namespace {

constexpr int kBitsPerByte = 8;
/// Acknowledgement and its delimiter, end of frame, pause: never stuffed.
constexpr int kTail = 1 + 1 + 7 + 3;
constexpr int kCrcDelimiter = 1;

/// A stuff bit follows five equal bits and counts for the next five: after the first, one in four.
constexpr int max_stuff_bits(int bits) noexcept { return (bits - 1) / 4; }

/// SRR in place of RTR, IDE, and the other 18 bits of the identifier.
constexpr int kExtension = 1 + 18;

CanFrameBits classic(int size, aurora::CanIdentifierSize identifier) noexcept {
  constexpr int kHead = 1 + 11 + 1 + 1 + 1 + 4;  // start, identifier, RTR, IDE, r0, DLC
  constexpr int kCrc = 15;
  const bool is_extended = identifier == aurora::CanIdentifierSize::kExtended;
  const int stuffed = kHead + (is_extended ? kExtension + 1 : 0) +  // and r1
                      kBitsPerByte * size + kCrc;
  return {stuffed + max_stuff_bits(stuffed) + kCrcDelimiter + kTail, 0};
}

CanFrameBits fd(int size, aurora::CanIdentifierSize identifier) noexcept {
  const bool is_extended = identifier == aurora::CanIdentifierSize::kExtended;
  const int arbitration = 1 + 11 + 1 + 1 + 1 + 1 + 1 +  // start, identifier, RRS, IDE, FDF, res, BRS
                          (is_extended ? kExtension : 0);
  constexpr int kControl = 1 + 4;  // ESI, DLC
  constexpr int kStuffCount = 4;
  constexpr int kMaxWithShortCrc = 16;  // bytes
  const int crc = kStuffCount + (size <= kMaxWithShortCrc ? 17 : 21);
  const int fixed_stuff = (crc + 3) / 4;  // before the first bit of it, and after every fourth
  const int data = kControl + kBitsPerByte * size;
  const int in_arbitration = max_stuff_bits(arbitration);
  const int in_data = max_stuff_bits(arbitration + data) - in_arbitration;
  return {arbitration + in_arbitration + kTail, data + in_data + crc + fixed_stuff + kCrcDelimiter};
}

}  // namespace

double CanFrameBits::seconds(const CanRates& rates) const noexcept {
  return nominal / rates.nominal_bits_per_second + data / rates.data_bits_per_second;
}

CanFrameBits max_frame_bits(int size, aurora::CanIdentifierSize identifier) noexcept {
  return size <= kBitsPerByte ? classic(size, identifier) : fd(size, identifier);
}

double bus_seconds(std::span<const aurora::CanFrame> frames, const CanRates& rates) noexcept {
  double seconds = 0;
  for (const aurora::CanFrame& frame : frames) {
    const bool is_extended = (frame.id & aurora::kCanExtended) != 0;
    const auto identifier =
        is_extended ? aurora::CanIdentifierSize::kExtended : aurora::CanIdentifierSize::kStandard;
    seconds += max_frame_bits(frame.size, identifier).seconds(rates);
  }
  return seconds;
}

}  // namespace tubed
