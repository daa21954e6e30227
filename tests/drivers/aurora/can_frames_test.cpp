#include "drivers/aurora/can_frames.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "tests/drivers/aurora/drawn_replies.hpp"
#include "tests/drivers/aurora/hex_bytes.hpp"

namespace tubed::aurora {
namespace {

/// A frame as candump writes it: identifier and bytes.
CanFrame frame_of(std::uint32_t id, std::string_view hex) {
  const auto bytes = bytes_of(hex);
  CanFrame frame{id, static_cast<std::uint8_t>(bytes.size()), {}};
  std::copy(bytes.begin(), bytes.end(), frame.bytes.begin());
  return frame;
}

void expect_same(const CanFrame& a, const CanFrame& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.bytes, b.bytes);
}

// One sample of a real tracker, and its frames as a second implementation of the layout writes them.
const CanSync kMeasurement{0x18, 75'000};
const CanFrame kSync = frame_of(0x300, "18000000F8240100");
const CanFrame kFdCoil = frame_of(0x320,
                                  "1000010318000000F8240100623FFFFF2ADF0000B692FDFF686821FF054A0000"
                                  "3F0000000000000010FC18330D35F981");
const std::array<CanFrame, 3> kClassicCoil = {frame_of(0x340, "623FFF2ADF0013DD"),
                                              frame_of(0x341, "B692FD00007013E6"),
                                              frame_of(0x342, "C2786C015F2A132E")};

HandleReading recorded_reading() {
  HandleReading reading;
  reading.report = Report::kValid;
  reading.rotation = {0.8157, -0.0068, 0.5783, 0};
  reading.p_em_mm = {-49.31, 57.13, -159.05};
  reading.indicator = 0;
  reading.port_status.bits = 0x3F;
  return reading;
}

void normalise(Quaternion& q) {
  const double length = std::sqrt(q.q0 * q.q0 + q.qx * q.qx + q.qy * q.qy + q.qz * q.qz);
  q = {q.q0 / length, q.qx / length, q.qy / length, q.qz / length};
}

std::array<CanClassicPart, 3> parts_of(const std::array<CanFrame, 3>& frames) {
  return {unpack_classic_part(frames[0]).value(), unpack_classic_part(frames[1]).value(),
          unpack_classic_part(frames[2]).value()};
}

TEST(CanFrames, AreThoseOfTheLayout) {
  const HandleReading reading = recorded_reading();
  expect_same(pack_sync(kMeasurement), kSync);
  expect_same(pack_fd_coil(0, reading, kMeasurement, {}, 0x3318FC10), kFdCoil);
  const auto parts = pack_classic_coil(0, reading, kMeasurement);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    expect_same(parts[i], kClassicCoil[i]);
  }
}

TEST(CanFrames, GiveBackTheMeasurement) {
  const auto sync = unpack_sync(kSync);
  ASSERT_TRUE(sync);
  EXPECT_EQ(sync->frame, 0x18U);
  EXPECT_EQ(sync->time_us, 75'000U);
}

TEST(CanFrames, GiveBackACoilFromOneFdFrame) {
  const auto fd = unpack_fd_coil(kFdCoil);
  ASSERT_TRUE(fd);
  const HandleReading sent = recorded_reading();
  EXPECT_EQ(fd->coil.coil, 0);
  EXPECT_EQ(fd->coil.state, CanCoilState::kValid);
  EXPECT_EQ(fd->sequence, 3);
  EXPECT_EQ(fd->measurement.frame, 0x18U);
  EXPECT_EQ(fd->measurement.time_us, 75'000U);
  EXPECT_LT((fd->coil.p_em_mm - sent.p_em_mm).norm(), 1e-3);
  EXPECT_LT((fd->coil.axis_em - coil_axis(sent.rotation)).norm(), 1e-4);
  EXPECT_EQ(fd->coil.port_status.bits, 0x3FU);
  EXPECT_EQ(fd->tool_serial_number, 0x3318FC10U);
}

TEST(CanFrames, GiveBackACoilFromThreeClassicFrames) {
  const auto coil = join_classic_parts(parts_of(kClassicCoil));
  ASSERT_TRUE(coil);
  const HandleReading sent = recorded_reading();
  EXPECT_LT((coil->p_em_mm - sent.p_em_mm).norm(), 1e-3);
  EXPECT_LT((coil->axis_em - coil_axis(sent.rotation)).norm(), 2e-4);  // of a rotation rounded to 1e-4
  EXPECT_EQ(coil->port_status.bits, 0x31U);                            // switches are not sent
  EXPECT_EQ(coil_sample(*coil).status, CoilStatus::kOk);
}

TEST(CanFrames, KeepPositionToTheMicrometreAndTheAxisTo15TenThousandthsOfADegree) {
  DrawnReplies drawn(5);
  for (int k = 0; k < 2000; ++k) {
    HandleReading sent = drawn.reply(1, 8).handles[0];
    normalise(sent.rotation);
    const auto joined = join_classic_parts(parts_of(pack_classic_coil(3, sent, {8, 0})));
    ASSERT_TRUE(joined);
    ASSERT_EQ(joined->state == CanCoilState::kValid, sent.report == Report::kValid);
    if (sent.report == Report::kValid) {
      const double off_rad = joined->axis_em.cross(coil_axis(sent.rotation)).norm();
      ASSERT_LT(off_rad, 0.0015 * 3.14159 / 180);
      ASSERT_LT((joined->p_em_mm - sent.p_em_mm).cwiseAbs().maxCoeff(), 0.00051);
    }
  }
}

TEST(CanFrames, SendNoPoseForACoilWithoutOne) {
  HandleReading reading = recorded_reading();
  reading.report = Report::kMissing;
  const auto missing = unpack_fd_coil(pack_fd_coil(1, reading, kMeasurement, {}, 0));
  ASSERT_TRUE(missing);
  EXPECT_EQ(missing->coil.state, CanCoilState::kMissing);
  EXPECT_TRUE(missing->coil.p_em_mm.hasNaN());
  reading.report = Report::kUnoccupied;
  EXPECT_EQ(unpack_fd_coil(pack_fd_coil(1, reading, kMeasurement, {}, 0))->coil.state,
            CanCoilState::kDisabled);
}

TEST(CanFrames, SendACoilThatFixedPointCannotHoldAsMissing) {
  HandleReading reading = recorded_reading();
  reading.p_em_mm.y() = -8388.7;
  const auto classic = join_classic_parts(parts_of(pack_classic_coil(0, reading, kMeasurement)));
  EXPECT_EQ(classic->state, CanCoilState::kMissing);
  EXPECT_EQ(unpack_fd_coil(pack_fd_coil(0, reading, kMeasurement, {}, 0))->coil.state, CanCoilState::kValid);
  reading.p_em_mm.y() = HandleReading::kNaN;
  EXPECT_EQ(unpack_fd_coil(pack_fd_coil(0, reading, kMeasurement, {}, 0))->coil.state,
            CanCoilState::kMissing);
}

TEST(CanFrames, CarryEachNamedBitOfThePortStatus) {
  HandleReading reading = recorded_reading();
  for (const unsigned bit : {0U, 4U, 5U, 6U, 7U, 8U, 12U}) {
    reading.port_status.bits = 1U << bit;
    const auto coil = join_classic_parts(parts_of(pack_classic_coil(0, reading, kMeasurement)));
    EXPECT_EQ(coil->port_status.bits, 1U << bit);
  }
}

TEST(CanFrames, WithAnyByteDamagedAreNone) {
  const auto none = [](const CanFrame& frame) {
    return !unpack_fd_coil(frame) && !unpack_classic_part(frame);
  };
  for (const CanFrame& whole : {kFdCoil, kClassicCoil[0], kClassicCoil[1], kClassicCoil[2]}) {
    for (std::size_t at = 0; at < whole.size; ++at) {
      for (unsigned flip = 1; flip < 256; ++flip) {
        CanFrame damaged = whole;
        damaged.bytes[at] ^= static_cast<std::uint8_t>(flip);
        ASSERT_TRUE(none(damaged)) << whole.id << " byte " << at << " flip " << flip;
      }
    }
    CanFrame elsewhere = whole;
    elsewhere.id += 4;  // another coil's identifier
    EXPECT_TRUE(none(elsewhere));
  }
}

TEST(CanFrames, OfAnotherSizeAreNone) {
  for (int size = 0; size <= 255; ++size) {
    for (const CanFrame& whole : {kSync, kFdCoil, kClassicCoil[0]}) {
      if (size == whole.size) {
        continue;
      }
      CanFrame other = whole;
      other.size = static_cast<std::uint8_t>(size);
      EXPECT_FALSE(unpack_sync(other));
      EXPECT_FALSE(unpack_fd_coil(other));
      EXPECT_FALSE(unpack_classic_part(other));
      EXPECT_LE(other.payload().size(), 64U);
    }
  }
}

TEST(CanFrames, OfDifferentMeasurementsOrStatesAreNotJoined) {
  const HandleReading reading = recorded_reading();
  const auto now = pack_classic_coil(0, reading, {0x18, 0});
  const auto later = pack_classic_coil(0, reading, {0x20, 0});
  const auto other_coil = pack_classic_coil(1, reading, {0x18, 0});
  HandleReading missing = reading;
  missing.report = Report::kMissing;
  const auto gone = pack_classic_coil(0, missing, {0x18, 0});
  EXPECT_TRUE(join_classic_parts(parts_of(now)));
  for (const auto& other : {later, other_coil, gone}) {
    EXPECT_FALSE(join_classic_parts(parts_of({now[0], now[1], other[2]})));
  }
  EXPECT_FALSE(join_classic_parts(parts_of({now[1], now[0], now[2]})));
}

TEST(CanStatus, SurvivesPackingAndSeesDamage) {
  const CanFrame frame = pack_status({kCanProtocol, 5, {0x00C0}, 0x0007, 2});
  const auto status = unpack_status(frame);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->coil_count, 5);
  EXPECT_EQ(status->system_status.bits, 0x00C0);
  EXPECT_EQ(status->ports_present, 7);
  EXPECT_EQ(status->gateway_error, 2);
  for (std::size_t at = 0; at < frame.size; ++at) {
    CanFrame damaged = frame;
    damaged.bytes[at] ^= 1;
    EXPECT_FALSE(unpack_status(damaged)) << at;
  }
}

TEST(CanStatus, OfAnotherProtocolIsNone) { EXPECT_FALSE(unpack_status(pack_status({0x20, 5, {}, 0, 0}))); }

}  // namespace
}  // namespace tubed::aurora
