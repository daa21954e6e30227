#include "drivers/laboratory/aurora_emulator/truth_log.hpp"

#include <array>
#include <cstdio>
#include <stdexcept>
#include <string_view>

namespace tubed::aurora::emulator {

namespace {

std::string_view word(CoilStatus status) {
  switch (status) {
    case CoilStatus::kOk:
      return "OK";
    case CoilStatus::kOutOfVolume:
      return "OUT_OF_VOLUME";
    case CoilStatus::kDisabled:
      return "DISABLED";
    case CoilStatus::kMissing:
      break;
  }
  return "MISSING";
}

}  // namespace

TruthLog::TruthLog(const std::filesystem::path& file, int sensors) : out_(file), sensors_(sensors) {
  out_ << "frame,measured_ns,sensor,status,x,y,z,tx,ty,tz\n" << std::flush;
  if (!out_) {
    throw std::runtime_error("truth log " + file.string() +
                             " cannot be written; does its folder exist and may it be written?");
  }
}

void TruthLog::write(const Measurement& measurement) {
  for (int sensor = 1; sensor <= sensors_; ++sensor) {
    const HandleReading& reading = measurement.coils[static_cast<std::size_t>(sensor - 1)];
    const CoilSample coil = coil_sample(reading);
    out_ << measurement.frame << ',' << to_ns(measurement.time) << ',' << sensor << ',' << word(coil.status);
    if (coil.p_em_mm.allFinite()) {
      std::array<char, 160> pose{};
      std::snprintf(pose.data(), pose.size(), ",%.6f,%.6f,%.6f,%.9f,%.9f,%.9f\n", coil.p_em_mm.x(),
                    coil.p_em_mm.y(), coil.p_em_mm.z(), coil.tangent_em.x(), coil.tangent_em.y(),
                    coil.tangent_em.z());
      out_ << pose.data();
    } else {
      out_ << ",,,,,,\n";
    }
  }
}

}  // namespace tubed::aurora::emulator
