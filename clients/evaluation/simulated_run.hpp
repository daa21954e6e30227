// A simulated catheterisation as a sequence folder with its truth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "clients/evaluation/simulated_reference.hpp"
#include "clients/evaluation/true_run.hpp"
#include "drivers/laboratory/scenario.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

/// Which run. The same values give the same files.
struct SimulatedRun {
  std::string preset = "paper";
  std::int64_t seed = 1;
  std::string vessel{};                ///< file of a vessel of your own; empty: the preset's aorta
  double hook_radius_mm = 0;           ///< the catheter's tip is a hook; 0: as the preset has it
  double hook_length_mm = 0;           ///< 0: see HookChoice
  std::vector<double> hook_arcs_mm{};  ///< the same, see HookChoice
  double tip_coil_mm = 0;              ///< from the tip to the first coil; 0: as the preset has it
  std::vector<double> coils_mm{};  ///< from the tip to each coil, ascending; empty: as the preset has them
  double tip_stiffness = 0;    ///< of the bendable tip, as a multiple of the shaft's; 0: as the preset has it
  std::string panel{};         ///< what takes the pictures: see parse_panel(); empty: as the preset has it
  bool tells_marks = false;    ///< the described room says where the catheter's electrodes are
  bool undisturbed = false;    ///< see undisturbed() of scenario.hpp
  int every = 1;               ///< only every so many-th exposure
  double rate_hz = 0;          ///< exposures a second of the first view; 0: as the preset has it
  int second_view_every = 0;   ///< second view with every so many-th of them; 0: as the preset has it
  double swing_deg = 0;        ///< the first view swings by so much every 20 s; 0: as the preset has it
  bool announces_pose = true;  ///< images of a view that moves say how it stood
  double pose_noise_deg = 0.1;  ///< of what they say then, standard deviation
  double pose_noise_mm = 1;
  double pan_mm = 0;                    ///< the table pans by so much, once
  double turn_deg = 0;                  ///< the C-arm of the first view turns by so much, once
  double zoom = 1;                      ///< its focal lengths become so many times what they were, once
  double move_at_s = -1;                ///< when these begin; negative: half way through
  bool moves_unseen = false;            ///< no fluoroscopy while they do
  std::vector<std::string> mistakes{};  ///< what is wrong: see room_mistakes.hpp
  SimulatedReference reference{};       ///< how the field generator moves, and by what that is noticed
};

/// The preset with what `run` changes; its room is the real one. Throws std::runtime_error for a vessel that
/// cannot be used, and for a second view of a preset that has one, std::invalid_argument for mistakes,
/// hooks and coils that cannot be made.
Scenario scenario_of(const SimulatedRun& run);

/// The same room as sequence.toml describes it.
RoomDescription described_room_of(const SimulatedRun& run, const Scenario& scenario);

/// All measurements of its coils in order of time. Runs the mechanics first unless they were run.
std::vector<SequenceMeasurement> simulated_measurements(const SimulatedRun& run, const Scenario& scenario);

/// Are its pictures others than those of the same run without mistakes and moves?
bool changes_pictures(const SimulatedRun& run);

/// The folder of `run`, made from that of the same run without mistakes: `clean` with the description, stamps
/// and measurements that the mistakes give it, and the same pictures. Precondition: !changes_pictures(run).
Sequence with_mistakes(Sequence clean, const SimulatedRun& run, const Scenario& scenario);

/// The truth of `sequence`, written by or made for `run`, with the cameras as they are and as they stood,
/// whatever sequence and images say of them.
TrueRun true_run_of(const SimulatedRun& run, const Scenario& scenario, const Sequence& sequence);

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
