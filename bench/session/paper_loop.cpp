#include "bench/session/paper_loop.hpp"

#include <opencv2/core.hpp>
#include <stdexcept>

#include "bench/stages/opencv_frangi.hpp"
#include "bench/support/exchange.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/image/image_checks.hpp"
#include "daemon/publishing/dds_publisher.hpp"
#include "drivers/image_shm/image_shm_driver.hpp"
#include "drivers/interface/read_until.hpp"
#include "drivers/replay/replay_driver.hpp"

namespace tubed {

namespace {

MonotonicTime now() { return from_ns(monotonic_ns()); }

class PaperLoop {
 public:
  PaperLoop(const Scene& scene, const std::filesystem::path& folder, int domain, std::int64_t start_ns)
      : camera_(scene.room().cameras.front()),
        images_(make_shm_image_source(scene.room(), DriverSettings({{"user", std::string()}}),
                                      image_socket(folder, camera_), 0)),
        em_(make_replay_em_source(scene.room(), DriverSettings({{"folder", (folder / "em").string()},
                                                                {"loop", false},
                                                                {"start_monotonic_ns", start_ns},
                                                                {"memory_limit_mb", std::int64_t{2048}}}))),
        frangi_(FrangiSettings{}),
        estimator_(make_estimator(settings(), scene.room().instruments.front(), scene.room())),
        publisher_(dds(domain), {identity(scene)}) {
    frame_.reserve(camera_.width, camera_.height);
    measurement_.reserve(camera_.width, camera_.height);
  }

  void open(std::int64_t until_ns) {
    const OpenResult em = em_->open();
    if (!em.ok) throw std::runtime_error(em.why);
    while (!images_->open().ok && monotonic_ns() < until_ns) sleep_until_ns(monotonic_ns() + 20'000'000);
  }

  /// One turn of the loop; false when no image came.
  bool step(WrittenEstimate& written) {
    if (read_until(*images_, frame_, now() + std::chrono::milliseconds(100)) != ReadOutcome::kFrame)
      return false;
    while (em_->read(coils_) == ReadOutcome::kFrame) history_.add(coils_);
    filter();
    solve();
    publish(written);
    return true;
  }

 private:
  static EstimatorSettings settings() {
    EstimatorSettings settings;
    settings.mode = EstimatorMode::kPaper;
    return settings;
  }
  static DdsSettings dds(int domain) {
    DdsSettings settings;
    settings.domain = domain;
    return settings;
  }
  static TubeIdentityValues identity(const Scene& scene) {
    TubeIdentityValues identity;
    identity.instrument_id = scene.room().instruments.front().id;
    return identity;
  }

  void filter() {
    measurement_.frame_number = frame_.frame_number;
    measurement_.exposure = frame_.exposure;
    measurement_.origin = frame_.origin;
    measurement_.grabbed = frame_.received;
    measurement_.frangi_started = now();
    measurement_.rejection = door_.take(frame_, measurement_);
    measurement_.state =
        measurement_.rejection == ImageRejection::kNone ? ImageState::kMeasured : ImageState::kRejected;
    const cv::Mat grey(camera_.height, camera_.width, CV_8U, frame_.pixels.data());
    const cv::Mat& vesselness = frangi_.filter(grey);
    std::copy(vesselness.begin<float>(), vesselness.end<float>(), measurement_.vesselness.begin());
    measurement_.frangi_finished = now();
  }

  void solve() {
    Observation observation;
    observation.instant = measurement_.exposure;
    observation.now = now();
    observation.is_image_instant = true;
    observation.em = &history_;
    observation.images[0] = &measurement_;
    observation.newest_image = measurement_.exposure;
    observation.image_timeout = std::chrono::milliseconds(500);
    estimate_.instrument = 0;
    ++estimate_.sequence_number;
    estimate_.image_frame = measurement_.frame_number;
    estimate_.stamps = {};
    estimate_.stamps.exposure_ns = to_ns(measurement_.exposure);
    estimate_.stamps.image_grabbed_ns = to_ns(measurement_.grabbed);
    estimate_.stamps.frangi_started_ns = to_ns(measurement_.frangi_started);
    estimate_.stamps.frangi_finished_ns = to_ns(measurement_.frangi_finished);
    estimate_.stamps.optimizer_started_ns = to_ns(observation.now);
    estimator_->estimate(observation, estimate_);
    estimate_.stamps.optimizer_finished_ns = monotonic_ns();
  }

  void publish(WrittenEstimate& written) {
    const StageStamps& stamps = estimate_.stamps;
    const std::int64_t called_ns = monotonic_ns();
    publisher_.publish(estimate_);
    written = {estimate_.sequence_number,
               1,
               estimate_.image_frame,
               static_cast<std::uint32_t>(estimate_.validity),
               estimate_.has_image ? 1U : 0U,
               stamps.exposure_ns,
               stamps.image_grabbed_ns,
               stamps.frangi_started_ns,
               stamps.frangi_finished_ns,
               stamps.em_measured_ns,
               stamps.optimizer_started_ns,
               stamps.optimizer_finished_ns,
               called_ns,
               called_ns,
               monotonic_ns()};
  }

  CameraCalibration camera_;
  std::unique_ptr<ImageSource> images_;
  std::unique_ptr<EmSource> em_;
  OpencvFrangi frangi_;
  std::unique_ptr<Estimator> estimator_;
  DdsPublisher publisher_;
  EmHistory history_;
  EmFrame coils_;
  ImageFrame frame_;
  ImageMeasurement measurement_;
  ImageDoor door_;
  TubeEstimate estimate_;
};

}  // namespace

void run_paper_loop(const Scene& scene, const std::filesystem::path& folder, int domain,
                    std::int64_t start_ns, std::int64_t until_ns,
                    const std::function<void(const WrittenEstimate&)>& wrote) {
  cv::setNumThreads(1);
  PaperLoop loop(scene, folder, domain, start_ns);
  loop.open(until_ns);
  WrittenEstimate written{};
  while (monotonic_ns() < until_ns) {
    if (loop.step(written)) wrote(written);
  }
}

}  // namespace tubed
