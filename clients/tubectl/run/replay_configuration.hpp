// The configuration file with which the daemon replays a sequence folder.
#pragma once

#include <string>

#include "daemon/estimator/estimator_settings.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

enum class ReplayLength { kOnce, kForEver };
enum class TrackedTwice { kNo, kEmAloneToo };

struct ReplayConfigurationSettings {
  EstimatorMode mode = EstimatorMode::kJoint;
  ReplayLength replay = ReplayLength::kOnce;
  TrackedTwice instruments = TrackedTwice::kNo;  ///< kEmAloneToo: "<id>-em" on the same coils, mode = "em"
  int dds_domain = 0;
};

/// TOML text for `tubed`: room, instrument and folder (as an absolute path) of the sequence, everything else
/// as defaults. Numbers are written so that reading gives them back to the last bit.
std::string replay_configuration(const Sequence& sequence, const ReplayConfigurationSettings& settings);

}  // namespace tubed
