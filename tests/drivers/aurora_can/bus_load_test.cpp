#include "drivers/aurora_can/bus_load.hpp"

#include <gtest/gtest.h>

#include "drivers/aurora_can/can_packer.hpp"

namespace tubed {
namespace {

// ISO 11898-1; K. Tindell's worst case of 135 bits for 8 bytes.
TEST(BusLoad, AClassicFrameOfEightBytesHas135Bits) {
  EXPECT_EQ(max_frame_bits(8).nominal, 135);
  EXPECT_EQ(max_frame_bits(8).data, 0);
}

// A head of 39 bits instead of 19 (SRR, 18 more of the identifier, r1), and a stuff bit for every four of
// these.
TEST(BusLoad, AnIdentifierOf29BitsCosts20BitsAndTheirStuffBits) {
  EXPECT_EQ(max_frame_bits(8, aurora::CanIdentifierSize::kExtended).nominal, 135 + 25);
  EXPECT_EQ(max_frame_bits(48, aurora::CanIdentifierSize::kExtended).nominal, 33 + 19 + 4);
}

TEST(BusLoad, AnFdFrameOf48BytesSwitchesItsRate) {
  EXPECT_EQ(max_frame_bits(48).nominal, 33);
  EXPECT_EQ(max_frame_bits(48).data, 519);
  EXPECT_NEAR(max_frame_bits(48).seconds({500e3, 2e6}), 325.5e-6, 1e-9);
  EXPECT_NEAR(max_frame_bits(48).seconds({1e6, 5e6}), 136.8e-6, 1e-9);
}

/// Bits of a classic frame as they go over the wire, stuffed; without the tail.
int stuffed_bits(const aurora::CanFrame& frame) {
  std::vector<int> bits{0};
  const auto put = [&bits](std::uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) {
      bits.push_back(static_cast<int>(value >> i & 1U));
    }
  };
  put(frame.id, 11);
  put(0, 3);
  put(frame.size, 4);
  for (const std::uint8_t byte : frame.payload()) {
    put(byte, 8);
  }
  std::uint32_t crc = 0;  // 0x4599, 15 bits
  for (const int bit : bits) {
    const bool flip = (crc >> 14 & 1U) != static_cast<std::uint32_t>(bit);
    crc = (crc << 1 & 0x7FFFU) ^ (flip ? 0x4599U : 0U);
  }
  put(crc, 15);
  int stuff = 0;
  int run = 0;
  int last = -1;
  for (const int bit : bits) {
    run = bit == last ? run + 1 : 1;
    last = bit;
    if (run == 5) {
      ++stuff;
      last = 1 - bit;
      run = 1;
    }
  }
  return static_cast<int>(bits.size()) + stuff;
}

TEST(BusLoad, NoFrameThatThePackerSendsIsLongerThanTheLongest) {
  CanPacker packer(CanLayout::kClassic, 8);
  int longest = 0;
  for (std::uint32_t n = 0; n < 500; ++n) {
    CanReport report;
    report.sync = {8 * n, 25'000 * n};
    for (std::size_t coil = 0; coil < 8; ++coil) {
      report.coils[coil].report = n % 3 == 0 ? aurora::Report::kMissing : aurora::Report::kValid;
      report.coils[coil].rotation = {1, 0, 0, 0};
      report.coils[coil].p_em_mm = {0.001 * n, -1.0 * n, 0};
      report.coils[coil].indicator = 0;
    }
    for (const aurora::CanFrame& frame : packer.pack(report, from_ns(n * 25'000'000LL))) {
      longest = std::max(longest, stuffed_bits(frame) + 13);
    }
  }
  EXPECT_LE(longest, max_frame_bits(8).nominal);
  EXPECT_GT(longest, 111) << "no frame was stuffed at all";
}

TEST(BusLoad, AMeasurementIsSyncFollowUpStatusAndTheCoils) {
  CanPacker classic(CanLayout::kClassic, 5);
  CanPacker fast(CanLayout::kFd, 5);
  const CanRates rates{1e6, 5e6};
  EXPECT_NEAR(bus_seconds(classic.pack({}, {}), rates), (3 + 15) * 135e-6, 1e-9);
  EXPECT_NEAR(bus_seconds(fast.pack({}, {}), rates), 3 * 135e-6 + 5 * 136.8e-6, 1e-9);
}

}  // namespace
}  // namespace tubed
