#include "drivers/laboratory/instrument/catheterisation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/laboratory/random/counter_random.hpp"

namespace tubed {

namespace {

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::vector<CatheterCommand> paper_commands() {
  constexpr CatheterCommand kInsert{1, 0, 0};
  constexpr CatheterCommand kBend{0, 0, 10 * std::numbers::pi / 180};
  std::vector<CatheterCommand> commands(83, kInsert);
  commands.insert(commands.end(), 4, kBend);
  commands.insert(commands.end(), 70, kInsert);
  commands.insert(commands.end(), 5, kBend);
  commands.insert(commands.end(), 175, kInsert);
  return commands;
}

RunReport Catheterisation::report() const {
  RunReport report;
  report.steps = steps.size();
  std::vector<double> penetrations;
  std::vector<double> moves;
  for (const StepReport& step : steps) {
    penetrations.push_back(step.max_penetration_mm);
    moves.push_back(step.tip_move_mm);
    report.max_length_error = std::max(report.max_length_error, step.length_error);
    report.max_move_mm = std::max(report.max_move_mm, step.max_move_mm);
    report.snaps += step.snapped ? 1 : 0;
    report.unfinished += step.converged && step.stable ? 0 : 1;
    report.iterations += step.iterations;
  }
  if (!steps.empty()) {
    report.max_penetration_mm = *std::max_element(penetrations.begin(), penetrations.end());
  }
  report.median_penetration_mm = median(std::move(penetrations));
  report.median_tip_move_mm = median(std::move(moves));
  return report;
}

CatheterisationStart start_for(const Vessel& vessel, double roll_rad, std::int64_t seed,
                               const std::vector<CatheterCommand>& commands) {
  constexpr double kLongerWay_mm = 36;
  constexpr double kMaxRollError_rad = 0.25;
  constexpr std::int64_t kRollStream = 7003;
  double inserted_mm = 0;
  for (const CatheterCommand& command : commands) {
    inserted_mm += command.insert_mm;
  }
  CounterRandom random(seed, kRollStream, 0);
  return {vessel.route_length_mm() + kLongerWay_mm - inserted_mm,
          roll_rad + kMaxRollError_rad * random.signed_unit()};
}

Catheterisation catheterise(const Vessel& vessel, const CatheterProperties& properties,
                            const CatheterisationStart& start, const std::vector<CatheterCommand>& commands,
                            const std::function<void(std::size_t)>& progress) {
  Catheter catheter(properties, vessel.introducer, &vessel.wall, vessel.route, start.insertion_mm,
                    start.roll_rad);
  Catheterisation run;
  run.shapes.push_back(catheter.shape());
  run.insertion_mm.push_back(catheter.insertion_mm());
  for (const CatheterCommand& command : commands) {
    run.steps.push_back(catheter.apply(command));
    run.shapes.push_back(catheter.shape());
    run.insertion_mm.push_back(catheter.insertion_mm());
    if (progress) {
      progress(run.steps.size());
    }
  }
  return run;
}

}  // namespace tubed
