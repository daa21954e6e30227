// Where the verbs that calibrate coils get their measurements: sequence folders, or a running daemon.
#pragma once

#include <string>
#include <vector>

#include "clients/calibration/coil_recording.hpp"
#include "clients/cpp/subscription.hpp"
#include "clients/evaluation/configured_sequence.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {

struct CoilSourceOptions {
  std::vector<std::string> recordings;  ///< sequence folders; none: a running daemon
  double seconds = 20;                  ///< to listen to it
  Subscription subscription;
};

/// Adds RECORDING..., --seconds and the DDS options; they write into `options`, which has to outlive it.
void add_coil_source_options(CommandLine verb, CoilSourceOptions& options);

/// A folder as its own room, or as the configuration (empty: none) has it. Throws as read_sequence() and
/// as_configured(), and CalibrationError for a room with a patient's reference, whose coils move with it.
ConfiguredSequence read_recording(const std::string& folder, const std::string& config);

/// One recording a folder, or that of the daemon. What is known of the instrument comes from `config`,
/// otherwise from the folder, or from what the daemon says of itself. Throws as read_recording(), and
/// CalibrationError when no daemon publishes coils.
std::vector<CoilRecording> read_coils(const CoilSourceOptions& options, const std::string& config);

}  // namespace tubed
