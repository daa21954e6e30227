// A recording as the daemon would reconstruct it with a given configuration.
#pragma once

#include <chrono>
#include <filesystem>

#include "daemon/config/configuration.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

/// What was recorded, with what the configuration makes of it.
struct ConfiguredSequence {
  Sequence sequence;  ///< its room is the configuration's: registration, cameras, the instrument alone
  EstimatorSettings estimator;
  FrangiSettings frangi;
  std::chrono::nanoseconds max_image_timeout{0};
};

/// Cameras are matched by name, the instrument by the catheter's id, or it is the only one configured. What
/// is recorded stays: measurements, images, truth, and each frame's geometry unless the configuration's holds
/// for every image of its camera. What the configuration says that a camera's stamps are late by is taken off
/// its frames' times, as the daemon does. Throws std::runtime_error
/// for a camera of the sequence that the configuration does not have, or has with another size, and when it
/// is not clear which instrument is meant.
ConfiguredSequence as_configured(Sequence sequence, const Configuration& configuration);

/// The same with a file, which is checked as `tubed --check` does but for what of it concerns the machine.
/// Throws ConfigurationError, too.
ConfiguredSequence as_configured(Sequence sequence, const std::filesystem::path& file);

}  // namespace tubed
