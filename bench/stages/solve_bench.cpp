#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/session/scene.hpp"
#include "bench/stages/ceres_map.hpp"
#include "bench/stages/stages.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/tube_map.hpp"
#include "daemon/image/frangi.hpp"
#include "daemon/image/image_checks.hpp"

namespace tubed {

namespace {

constexpr int kInstants = 24;      // within a second of the scene
constexpr int kLongInstants = 96;  // with what is asked every two seconds
constexpr int kInstantsEachTurn = 4;

/// What the optimizer has before it at instants of the simulated catheter in the arch.
class Instants {
 public:
  explicit Instants(int count)
      : scene_(SceneSettings{}),
        frangi_(room().cameras.front().width, room().cameras.front().height, FrangiSettings{}) {
    const CameraCalibration& camera = room().cameras.front();
    ImageDoor door;
    ImageFrame frame;
    frame.reserve(camera.width, camera.height);
    for (int k = 0; k < count; ++k) {
      frame.exposure = frame.received = exposure(k);
      frame.fluoroscopy_on = true;
      frame.frame_number = static_cast<std::uint32_t>(k + 1);
      const std::vector<std::uint8_t>& picture = scene_.picture(0, k);
      std::copy(picture.begin(), picture.end(), frame.pixels.begin());
      ImageMeasurement& image = *images_.emplace_back(std::make_unique<ImageMeasurement>());
      image.reserve(camera.width, camera.height);
      image.exposure = exposure(k);
      image.frame_number = frame.frame_number;
      image.rejection = door.take(frame, image);
      if (image.rejection != ImageRejection::kNone)
        throw std::runtime_error("the scene's picture was refused");
      frangi_.filter(image.grey, image.vesselness);
      image.state = ImageState::kMeasured;
    }
    for (int k = 0; k < static_cast<int>(count * scene_.settings().em_rate_hz / scene_.settings().rate_hz);
         ++k) {
      history_.add(scene_.measurement(k));
    }
  }

  [[nodiscard]] const RoomDescription& room() const { return scene_.room(); }
  [[nodiscard]] const EmHistory& history() const { return history_; }

  /// Once more, as the stage before the optimizer has done just now: its maps are in the processor's caches.
  void filter(int k) {
    ImageMeasurement& image = *images_[static_cast<std::size_t>(k)];
    frangi_.filter(image.grey, image.vesselness);
  }

  [[nodiscard]] Observation at(int k) const {
    Observation observation;
    observation.instant = observation.now = observation.newest_image = exposure(k);
    observation.is_image_instant = true;
    observation.em = &history_;
    observation.images[0] = images_[static_cast<std::size_t>(k)].get();
    observation.image_timeout = std::chrono::milliseconds(500);
    return observation;
  }

 private:
  [[nodiscard]] MonotonicTime exposure(int k) const {
    return from_ns(static_cast<std::int64_t>((k + 1) * 1e9 / scene_.settings().rate_hz));
  }

  Scene scene_;
  FrangiFilter frangi_;
  std::vector<std::unique_ptr<ImageMeasurement>> images_;
  EmHistory history_;
};

/// One instant's coils and lines, and the shape of the coils from which the solvers begin.
struct OneSolve {
  EstimatorSettings settings;
  TubeMap map;
  TubeViews views;
  CoilObservations coils;
  Eigen::Matrix3Xd start;
  TubeEstimate estimate;

  OneSolve(const Instants& instants, int coefficient_count)
      : settings(with(coefficient_count)),
        map(settings, instants.room().instruments.front().length_mm),
        views(settings, instants.room().instruments.front(), instants.room()),
        start(Eigen::Matrix3Xd::Zero(3, coefficient_count)) {
    const Observation observation = instants.at(kInstants / 2);
    const EmFrame* frame = instants.history().newest_until(observation.instant);
    coils = observe_coils(frame, instants.history(), instants.room().instruments.front(),
                          instants.room().T_world_em, 150'000'000);
    bool converged = false;
    if (!map.solve_linear(coils, start)) throw std::runtime_error("the scene has too few coils");
    map.refine(coils, {}, nullptr, settings.iterations, start, converged);
  }

  static EstimatorSettings with(int coefficient_count) {
    EstimatorSettings settings;
    settings.coefficient_count = coefficient_count;
    return settings;
  }

  bool look(const Observation& observation) {
    return views.measure(observation, map.spline(), start, {static_cast<int>(settings.image_search_px)},
                         estimate);
  }
};

void measure_likelihood(const StageChoice& choice, const Instants& instants, Report& report) {
  const std::string name = "likelihood/400x600/lines";
  if (!choice.wants(name)) return;
  OneSolve one(instants, EstimatorSettings{}.coefficient_count);
  const Observation observation = instants.at(kInstants / 2);
  const TurnTimes times = take_turns(
      {choice.turns, 3, 4, 1}, [&] { one.look(observation); }, [] {});
  report.add({name, "ms", times.own_ms, "", {}, {}, {}});
}

void measure_map(const StageChoice& choice, const Instants& instants, int coefficients, Report& report) {
  const std::string name = "solve/" + std::to_string(coefficients) + "/coils_and_lines";
  if (!choice.wants(name)) return;
  OneSolve one(instants, coefficients);
  const Observation observation = instants.at(kInstants / 2);
  if (!one.look(observation)) throw std::runtime_error("the scene's picture shows no tube");
  const auto lines = one.views.constraints(observation, 1, true);
  if (lines.empty()) throw std::runtime_error("no lines were found in the scene's picture");
  const auto all = std::span(lines.front().lines, static_cast<std::size_t>(lines.front().count));
  for (const auto& [peer, solver] : {std::pair{"ceres-sparse-cholesky", ceres::SPARSE_NORMAL_CHOLESKY},
                                     std::pair{"ceres-dense-cholesky", ceres::DENSE_NORMAL_CHOLESKY}}) {
    CeresMap ceres(one.settings, one.map.spline(), one.coils, instants.room().cameras.front(), all, solver);
    Eigen::Matrix3Xd C;
    bool converged = false;
    TurnTimes times = take_turns(
        {choice.turns, 3, 4, 1},
        [&] {
          C = one.start;
          one.map.refine(one.coils, lines, nullptr, one.settings.iterations, C, converged);
        },
        [&] { ceres.solve(one.start); });
    const double ceres_cost = ceres.solve(one.start);
    const double apart_mm = (C - ceres.C()).colwise().norm().maxCoeff();
    const double cost_ratio = ceres.cost_at(C) / ceres_cost;
    report.add(name + "/" + peer, peer, std::move(times),
               {{"lines", static_cast<double>(all.size())},
                {"converged", converged ? 1.0 : 0.0},
                {"max_difference_mm", apart_mm},
                {"cost_above_ceres", cost_ratio - 1}});
  }
}

/// Everything the optimizer does for an instant: what a subscriber waits for (two rounds of likelihood and
/// solves, covariance, verdict), and what is left until the estimate has gone.
void measure_instant(const StageChoice& choice, Report& report) {
  const std::string name = "instant/filter";
  if (!choice.wants(name)) return;
  Instants instants(kLongInstants);
  const auto estimator = [&](EstimatorMode mode) {
    EstimatorSettings settings;
    settings.mode = mode;
    return make_estimator(settings, instants.room().instruments.front(), instants.room());
  };
  const auto own = estimator(EstimatorMode::kFilter);
  const auto paper = estimator(EstimatorMode::kPaper);
  auto estimate = std::make_unique<TubeEstimate>();
  TurnTimes times;
  ReportRow after{name + "/after", "ms", {}, "", {}, {}, {}};
  const int turns = choice.turns * kInstantsEachTurn;
  for (int turn = -kLongInstants; turn < turns; ++turn) {
    const int k = (turn + kLongInstants) % kLongInstants;
    if (k == 0) own->reset();
    if (k == 0) paper->reset();
    const Observation observation = instants.at(k);
    instants.filter(k);
    const double own_ms = mean_ms(1, [&] { own->update(observation, *estimate); });
    const double after_ms = mean_ms(1, [&] { own->look_further(observation); });
    const bool is_kept = turn >= 0 && k > 0;  // the first one begins
    if (!is_kept) continue;
    times.own_ms.push_back(own_ms);
    after.values.push_back(after_ms);
    times.peer_ms.push_back(mean_ms(1, [&] { paper->estimate(observation, *estimate); }));
  }
  report.add(name, "mode paper", std::move(times));
  report.add(after);
}

}  // namespace

void measure_solve(const StageChoice& choice, Report& report) {
  if (!choice.wants("likelihood/400x600/lines") && !choice.wants("instant/filter") &&
      !choice.wants("solve/26/coils_and_lines") && !choice.wants("solve/48/coils_and_lines")) {
    return;
  }
  const Instants instants(kInstants);
  measure_likelihood(choice, instants, report);
  measure_map(choice, instants, 26, report);
  measure_map(choice, instants, 48, report);
  measure_instant(choice, report);
}

}  // namespace tubed
