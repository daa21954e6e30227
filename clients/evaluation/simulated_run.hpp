// A simulated catheterisation as a sequence folder with its truth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "clients/evaluation/simulated_reference.hpp"
#include "drivers/laboratory/scenario.hpp"

namespace tubed {

/// Which run. The same values give the same files.
struct SimulatedRun {
  std::string preset = "paper";
  std::int64_t seed = 1;
  std::string vessel{};         ///< file of a vessel of your own; empty: the preset's aorta
  int every = 1;                ///< only every so many-th exposure
  int second_view_every = 0;    ///< second view with every so many-th of them; 0: as the preset has it
  double swing_deg = 0;         ///< the first view swings by so much every 20 s; 0: as the preset has it
  bool announces_pose = true;   ///< images of a view that moves say how it stood
  double pose_noise_deg = 0.1;  ///< of what they say then, standard deviation
  double pose_noise_mm = 1;
  SimulatedReference reference{};  ///< how the field generator moves, and by what that is noticed
};

/// The preset with what `run` changes. Throws std::runtime_error for a vessel that cannot be used, and for a
/// second view of a preset that has one.
Scenario scenario_of(const SimulatedRun& run);

/// How many of all pieces of work are done. Called by the thread that works.
using RunProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Writes all exposures, then all measurements, each in order of time; runs the mechanics first unless they
/// were run (shared_run_of()). `scenario`: scenario_of(run). Returns the number of pictures. Throws
/// std::runtime_error for a folder that is not empty or cannot be written.
std::size_t write_simulated_run(const SimulatedRun& run, const Scenario& scenario,
                                const std::filesystem::path& folder, const RunProgress& progress = {});

/// Throws std::runtime_error when `folder` is there and not empty.
void require_empty(const std::filesystem::path& folder);

}  // namespace tubed
