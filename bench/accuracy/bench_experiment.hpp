// The paper's second experiment, Sec. 3.2, on the laboratory's preset "bench": a catheter kept still at five
// places of a mock-up, its truth segmented from a CT.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/accuracy/method.hpp"
#include "drivers/laboratory/scenario.hpp"

namespace tubed {

/// The preset that has halts.
inline constexpr const char* kBenchPreset = "bench";
/// Its last coil: both curves are judged up to here, as those of the simulation are up to 370 mm.
inline constexpr double kBenchLastCoil_mm = 274;

/// Everything random drawn once: aorta, positions, markers, field, noise of tracker, image and CT.
struct BenchDraw {
  std::int64_t seed = 0;
  std::vector<double> marker_residual_mm;  ///< one a marker
  std::vector<double> registration_mm;     ///< at each coil of each position: what the registration is off
  std::vector<double> coil_mm;       ///< the same: where the tracker says the coil is, in the world frame
  std::vector<double> truth_rms_mm;  ///< segmented truth from the simulation's own, one a position
  std::vector<MethodEvaluation> methods;  ///< one each of the methods; an instant a position
};

/// The part of a sequence that was recorded while the catheter stood still: the catheter comes there,
/// measurements run, the image is the last that is taken.
Sequence during(const Sequence& sequence, const TimeSpan& halt);

/// Simulates the draw of that seed into `folder` (or takes it from there), segments the truth of each
/// position, and judges the last estimate at each position, which every method begins anew at: modes em and
/// paper solve the instant of the image, filter has seen the measurements of the 2 s before and that one
/// image. Errors' axes are the camera's, Sec. 3.3. `told`: what is being done.
BenchDraw run_bench_draw(std::int64_t seed, const std::filesystem::path& folder,
                         const std::vector<Method>& methods, const ShapeErrorSettings& judged,
                         const std::function<void(const std::string&)>& told);

}  // namespace tubed
