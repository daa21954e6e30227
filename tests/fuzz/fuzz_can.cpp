// Any frames at any times through the assembler of measurements. 72 bytes a frame: identifier (2), size (1),
// pause before it in 0.1 ms (1), bytes (64), and one that says whether to put the check sum right (1); 3 are
// spare.
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "drivers/aurora/can_coil_assembler.hpp"
#include "drivers/aurora/checksums.hpp"

using namespace tubed::aurora;

namespace {

constexpr std::size_t kRecord = 72;

void demand(bool held) {
  if (!held) {
    std::abort();
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
  CanCoilAssembler assembler(coil_count);
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
    if ((bytes.u8() & 1) != 0) {
      put_check_sum_right(frame);
    }
    if (const auto measurement = assembler.accept(frame, now)) {
      check(*measurement, coil_count);
    }
    if (const auto measurement = assembler.expire(now)) {
      check(*measurement, coil_count);
    }
  }
  return 0;
}
