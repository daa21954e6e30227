// What the simulated fluoroscope costs on one core: the patient and a view once, then every exposure. A
// camera at 30 Hz leaves 33.3 ms for an exposure, which it shares with the daemon.
#include <benchmark/benchmark.h>

#include <vector>

#include "drivers/laboratory/fluoroscope/c_arm.hpp"
#include "drivers/laboratory/fluoroscope/clutter.hpp"
#include "drivers/laboratory/fluoroscope/radiograph.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"

namespace tubed {
namespace {

const AttenuationVolume& patient() {
  static const AttenuationVolume volume = make_thorax();
  return volume;
}

CameraCalibration paper_view() { return c_arm_view("A", {60, 0}, {0, -20, -95}); }

RadiographSettings settings_with_everything() {
  RadiographSettings settings;
  add_default_clutter(settings);
  add_lumen(settings, mean_aorta());
  add_motion(settings);
  return settings;
}

void make_patient(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(make_thorax());
  }
}

void cast_still_view(benchmark::State& state) {
  patient();
  for (auto _ : state) {
    benchmark::DoNotOptimize(Radiograph(paper_view(), patient(), {}, 1));
  }
}

void cast_moving_view(benchmark::State& state) {
  patient();
  for (auto _ : state) {
    benchmark::DoNotOptimize(Radiograph(paper_view(), patient(), settings_with_everything(), 1));
  }
}

void expose(benchmark::State& state, const ClutterStates& clutter) {
  static Radiograph radiograph(paper_view(), patient(), settings_with_everything(), 1);
  std::vector<std::uint8_t> pixels(radiograph.bytes_per_image());
  RadiographScene scene;
  scene.catheters.push_back(catheter_along(mean_aorta(), 0));
  scene.clutter = clutter;
  for (auto _ : state) {
    ++scene.exposure;
    scene.time_s += 1.0 / 30;
    radiograph.render(scene, pixels);
    benchmark::DoNotOptimize(pixels.data());
  }
  state.counters["exposures/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

BENCHMARK(make_patient)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(cast_still_view)->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(cast_moving_view)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(expose, catheter_alone, ClutterStates{})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(expose, heart_and_breath, ClutterStates{.heart_beat = true, .breathing = true})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(expose, contrast_agent, ClutterStates{.contrast_age_s = 1.5})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(expose, everything, ClutterStates{true, true, true, true, true, 1.5})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tubed

BENCHMARK_MAIN();
