// What the emulated tracker measured and when, for comparison with what a driver makes of it.
#pragma once

#include <filesystem>
#include <fstream>

#include "drivers/laboratory/aurora_emulator/measurements.hpp"

namespace tubed::aurora::emulator {

/// A CSV file, `frame,measured_ns,sensor,status,x,y,z,tx,ty,tz`: one row a measurement and sensor.
/// measured_ns is CLOCK_MONOTONIC; poses (em frame, mm; unit tangent) before they are rounded for the wire,
/// empty unless there is one. Faults of measurements are in it, those of replies are not.
class TruthLog {
 public:
  /// `sensors`: rows a measurement. Throws std::runtime_error when the file cannot be written.
  TruthLog(const std::filesystem::path& file, int sensors);

  void write(const Measurement& measurement);

 private:
  std::ofstream out_;
  int sensors_;
};

}  // namespace tubed::aurora::emulator
