#include "drivers/laboratory/bench_scenario.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "drivers/laboratory/random/counter_random.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kHaltStream = 7205;
constexpr std::int64_t kGeneratorStream = 7206;

constexpr int kHalts = 5;               ///< Sec. 3.2
constexpr std::size_t kFirstStep = 60;  ///< from here on a halt may come: the tip is below the arch
constexpr double kStepsPerS = 30;       ///< nobody watches the catheter between two halts
constexpr double kFrameRate_hz = 7.5;
constexpr std::size_t kStepsPerExposure = 4;
constexpr std::size_t kHaltExposures = 15;  ///< 2 s; all but the last but one without X-rays
static_assert(kStepsPerExposure * kFrameRate_hz == kStepsPerS);

/// Sec. 3.2: 8 mm from the tip and 86, 80, 100 mm on.
InstrumentDescription bench_catheter() {
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  catheter.length_mm = 290;
  int sensor = 0;
  for (const double offset_mm : {8.0, 94.0, 174.0, 274.0}) {
    catheter.coils.push_back({++sensor, offset_mm, false});
  }
  return catheter;
}

/// Of Sec. 3.1's view, f of Sec. 3.2; the arch and what of the catheter the smaller field of view still
/// holds.
void look_closer(CameraCalibration& camera) {
  constexpr double kDistance_mm = 1200;
  const Eigen::Vector3d target_world_mm(0, 0, -55);
  camera.fx = camera.fy = 2900;
  camera.T_camera_world.translation() =
      -camera.T_camera_world.linear() * target_world_mm + kDistance_mm * Eigen::Vector3d::UnitZ();
}

/// Halts and their images into the commands: after one step drawn from each fifth of those from kFirstStep
/// on.
void halt(Scenario& scenario) {
  const std::vector<CatheterCommand> moves = std::move(scenario.commands);
  const double part = static_cast<double>(moves.size() - kFirstStep) / kHalts;
  std::vector<CatheterCommand>& commands = scenario.commands;
  commands.clear();
  double off_from_s = 0;
  std::size_t done = 0;
  for (int i = 0; i < kHalts; ++i) {
    const double share = CounterRandom(scenario.seed, kHaltStream, i).unit();
    const std::size_t step = kFirstStep + static_cast<std::size_t>(std::floor((i + share) * part));
    commands.insert(commands.end(), moves.begin() + static_cast<std::ptrdiff_t>(done),
                    moves.begin() + static_cast<std::ptrdiff_t>(step));
    done = step;
    // Until an exposure is due, then the halt.
    const std::size_t first_exposure = (commands.size() + kStepsPerExposure - 1) / kStepsPerExposure;
    commands.resize((first_exposure + kHaltExposures) * kStepsPerExposure);
    const double image_s = static_cast<double>(first_exposure + kHaltExposures - 1) / kFrameRate_hz;
    const double half_s = 0.5 / kFrameRate_hz;
    scenario.halts.push_back(
        {static_cast<double>(first_exposure) / kFrameRate_hz - half_s / 2, image_s + half_s});
    scenario.fluoroscopy_off.push_back({off_from_s, image_s - half_s});
    off_from_s = image_s + half_s;
  }
  commands.insert(commands.end(), moves.begin() + static_cast<std::ptrdiff_t>(done), moves.end());
  scenario.fluoroscopy_off.push_back({off_from_s, 1e9});
}

/// Table-top: below the mock-up, its z toward it, turned as it happens to lie there.
RigidTransform true_T_world_em(std::int64_t seed) {
  CounterRandom random(seed, kGeneratorStream, 0);
  const Eigen::Vector3d place_world_mm(20 * random.signed_unit(), 180 + 20 * random.signed_unit(),
                                       -75 + 30 * random.signed_unit());
  const Eigen::AngleAxisd up(std::numbers::pi / 2, Eigen::Vector3d::UnitX());  // z becomes -y: anterior
  const Eigen::AngleAxisd lies(std::numbers::pi * random.signed_unit(), Eigen::Vector3d::UnitZ());
  return RigidTransform(Eigen::Translation3d(place_world_mm) * up * lies);
}

}  // namespace

SimulatedRegistration bench_registration(const Scenario& scenario) {
  const RigidTransform T_world_em = true_T_world_em(scenario.seed);
  const EmErrors field(scenario.em, scenario.seed, working_volume_mm(T_world_em.inverse()));
  return register_markers({}, T_world_em, field, scenario.seed);
}

void place_on_bench(Scenario& scenario) {
  scenario.body = Body::kMockUp;
  scenario.room.instruments = {bench_catheter()};
  look_closer(scenario.room.cameras.front());
  scenario.steps_per_s = kStepsPerS;
  scenario.frame_rate_hz = kFrameRate_hz;
  halt(scenario);
  scenario.em.warp_mm = 4;
  scenario.em.warp_rad = 3 * kDegree;
  scenario.em.jitter_mm = 0.5;
  scenario.em.jitter_rad = 0.2 * kDegree;
  scenario.room.T_world_em = bench_registration(scenario).T_world_em;
  scenario.registration_error = scenario.room.T_world_em.inverse() * true_T_world_em(scenario.seed);
}

}  // namespace tubed
