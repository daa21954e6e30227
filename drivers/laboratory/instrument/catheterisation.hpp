// A whole catheterisation: the shape after every command of a list.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "drivers/laboratory/instrument/catheter.hpp"

namespace tubed {

/// The paper's commands, Sec. 3.1: 83 mm of insertion, the tip to 40 deg, 70 mm, the tip to 50 deg more, 175
/// mm: 83 + 4 + 70 + 5 + 175 = 337 steps of 1 mm or 10 deg.
std::vector<CatheterCommand> paper_commands();

/// What a run was like; lengths mm.
struct RunReport {
  std::size_t steps = 0;
  double median_penetration_mm = 0;  ///< of the greatest of each step
  double max_penetration_mm = 0;
  double max_length_error = 0;  ///< of the whole catheter, as a share
  double median_tip_move_mm = 0;
  double max_move_mm = 0;  ///< of a node beyond following the catheter's path
  int snaps = 0;
  int unfinished = 0;  ///< steps that found no balance, or one that is not stable
  int iterations = 0;
};

/// Shapes and reports of a run. `shapes` has one entry more than `steps`: the first is before any command.
struct Catheterisation {
  std::vector<CatheterShape> shapes;
  std::vector<StepReport> steps;
  std::vector<double> insertion_mm;  ///< from introducer to tip, one a shape
  [[nodiscard]] RunReport report() const;
};

/// How a patient's run starts.
struct CatheterisationStart {
  double insertion_mm = 0;  ///< from introducer to tip
  double roll_rad = 0;      ///< of the bendable tip, from the introducer's reference
};

/// Where the paper's commands start so that they end short of the target of the vessel's route: the catheter
/// lies at the outside of the arch, a longer way than the route's. `seed` turns the roll within 0.25 rad.
CatheterisationStart start_for(const Vessel& vessel, double roll_rad, std::int64_t seed,
                               const std::vector<CatheterCommand>& commands);

/// Runs all commands; about 6 ms a step. `progress` (may be empty) is told the number of steps done.
Catheterisation catheterise(const Vessel& vessel, const CatheterProperties& properties,
                            const CatheterisationStart& start, const std::vector<CatheterCommand>& commands,
                            const std::function<void(std::size_t)>& progress = {});

}  // namespace tubed
