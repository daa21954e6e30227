// Any frames at any times through the assembler of measurements. The first byte chooses the coils and the
// base. 72 bytes a frame: identifier (2), size (1), pause before it in 0.1 ms (1), bytes (64), whether to put
// the check sum right (1), whether the identifier has 29 bits (1), and its upper ones (2).
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "drivers/aurora/can_coil_assembler.hpp"
#include "drivers/aurora/checksums.hpp"

using namespace tubed::aurora;

namespace {

constexpr std::size_t kRecord = 72;
constexpr std::array<CanBase, 4> kBases = {
    {{0x300}, {0x680}, {0x18FF'5000 | kCanExtended}, {0x300 | kCanExtended}}};

void demand(bool held) {
  if (!held) {
    std::abort();
  }
}

/// A listener of one base takes no frame of another one.
void check_identifier(const CanFrame& frame, CanBase base) {
  const auto place = base.place_of(frame.id);
  demand(place.has_value() == ((frame.id & ~(CanBase::kBlock - 1)) == base.id));
  if (!place) {
    demand(!unpack_sync(frame, base) && !unpack_status(frame, base) && !unpack_follow_up(frame, base) &&
           !unpack_fd_coil(frame, base) && !unpack_classic_part(frame, base));
  }
}

void put_check_sum_right(CanFrame& frame) {
  if (frame.size == 8) {
    frame.bytes[7] = can_crc8(frame.id, Bytes(frame.bytes).first(7));
  } else if (frame.size == 48) {
    ByteWriter(std::span(frame.bytes).subspan(44)).u32(can_crc32(frame.id, Bytes(frame.bytes).first(44)));
  }
}

void check(const CanMeasurement& measurement, int coil_count) {
  demand(measurement.coil_count == coil_count);
  demand(measurement.coils_lost >= 0 && measurement.coils_lost < coil_count);
  demand(measurement.last_received - measurement.sync_received <= CanCoilAssembler::kAssemblyTime);
  for (int i = 0; i < coil_count; ++i) {
    const CanCoil& coil = measurement.coils[static_cast<std::size_t>(i)];
    demand(coil.coil == i);
    const bool has_pose = coil.p_em_mm.allFinite() && std::abs(coil.axis_em.norm() - 1) < 1e-9;
    demand((coil.state == CanCoilState::kValid) == has_pose);
    static_cast<void>(coil_sample(coil));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  const int coil_count = data[0] % kMaxCanCoils + 1;
  const CanBase base = kBases[data[0] / kMaxCanCoils % kBases.size()];
  CanCoilAssembler assembler(coil_count, base);
  tubed::MonotonicTime now{};
  for (std::size_t at = 1; at + kRecord <= size; at += kRecord) {
    ByteReader bytes(Bytes(data + at, kRecord));
    CanFrame frame;
    frame.id = bytes.u16();
    frame.size = bytes.u8();
    now += std::chrono::microseconds(100 * bytes.u8());
    for (std::uint8_t& byte : frame.bytes) {
      byte = bytes.u8();
    }
    const bool is_sealed = (bytes.u8() & 1) != 0;
    if ((bytes.u8() & 1) != 0) {
      frame.id = (frame.id | static_cast<std::uint32_t>(bytes.u16()) << 16U) & 0x1FFF'FFFFU;
      frame.id |= kCanExtended;
    }
    if (is_sealed) {
      put_check_sum_right(frame);
    }
    check_identifier(frame, base);
    if (const auto measurement = assembler.accept(frame, now)) {
      check(*measurement, coil_count);
    }
    if (const auto measurement = assembler.expire(now)) {
      check(*measurement, coil_count);
    }
  }
  return 0;
}
