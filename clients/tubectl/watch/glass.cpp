#include "clients/tubectl/watch/glass.hpp"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>

#include "clients/cpp/tube_subscriber.hpp"
#include "clients/evaluation/flash_latency.hpp"
#include "clients/evaluation/statistics.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/silence.hpp"
#include "clients/tubectl/watch/test_screen.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;

// From one picture of the screen to the next: with the flashes between them still below 30 a second, from
// which on a daemon leaves pictures out.
constexpr milliseconds kPicture{40};
constexpr milliseconds kWhite{400};     // a flash lasts
constexpr milliseconds kMinNoise{500};  // from the end of a flash to the next, and
constexpr milliseconds kMoreNoise{
    400};  // so much more by chance, so that flashes meet every phase of the images
constexpr std::int64_t kSameClock_ns = 1'000'000'000;

volatile std::sig_atomic_t g_asked_to_end = 0;

FlashSample flash_sample(const TubeSample& sample) {
  const tubed_TubeEstimate& estimate = sample.estimate;
  FlashSample flash;
  flash.received_ns = sample.received_monotonic_ns;
  // Instants without radiation are image instants, too.
  flash.is_image_instant = estimate.is_image_instant && (estimate.reasons & tubed_REASON_IMAGE_OFF) == 0;
  flash.is_rejected = (estimate.reasons & tubed_REASON_IMAGE_REJECTED) != 0;
  // A monotonic clock of another host is somewhere else.
  const std::int64_t apart_ns = sample.received_monotonic_ns - estimate.valid_time_monotonic_ns;
  if (apart_ns > -kSameClock_ns && apart_ns < kSameClock_ns) {
    flash.exposure_ns = estimate.valid_time_monotonic_ns;
  }
  return flash;
}

/// When what is shown next.
class FlashSchedule {
 public:
  explicit FlashSchedule(MonotonicTime now) : next_picture_(now), next_turn_(now + kMinNoise) {}

  void step(MonotonicTime now, TestScreen& screen, FlashLatency& latency) {
    if (now >= next_turn_ && (is_white_ || latency.is_ready())) {
      is_white_ = !is_white_;
      if (is_white_) {
        latency.turn_white(screen.show(true));
      } else {
        latency.turn_to_noise();
      }
      next_turn_ = now + (is_white_ ? kWhite : kMinNoise + milliseconds(more_(random_)));
      next_picture_ = now + (is_white_ ? kPicture : milliseconds(0));
    }
    if (now >= next_picture_) {
      screen.show(is_white_);
      next_picture_ = std::max(next_picture_ + kPicture, now);
    }
  }

 private:
  MonotonicTime next_picture_, next_turn_;
  bool is_white_ = false;
  std::minstd_rand random_{7};
  std::uniform_int_distribution<int> more_{0, static_cast<int>(kMoreNoise.count())};
};

nlohmann::json row_of(const std::vector<double>& ms) {
  nlohmann::json row{{"n", ms.size()}};
  if (!ms.empty()) {
    for (const auto& [name, part] :
         {std::pair{"min", 0.0}, {"p50", 0.5}, {"p90", 0.9}, {"p99", 0.99}, {"max", 1.0}}) {
      row[name] = quantile(ms, part);
    }
  }
  return row;
}

std::string line_of(const char* words, const std::vector<double>& ms) {
  return fmt::format("  {:<34}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>8}", words, quantile(ms, 0.5),
                     quantile(ms, 0.9), quantile(ms, 0.99), quantile(ms, 1), ms.size());
}

void print(const FlashLatency& latency, const GlassArguments& arguments) {
  const auto late_ms = latency.stamps_late_ms();
  if (arguments.as_json) {
    nlohmann::json report{{"seconds", arguments.duration_s},
                          {"unit", "ms"},
                          {"flashes", latency.flashes()},
                          {"glass_to_shape", row_of(latency.to_shape_ms())},
                          {"glass_to_stamp", row_of(latency.to_stamp_ms())}};
    if (late_ms) report["stamps_late"] = *late_ms;
    if (const auto period_ms = latency.period_ms()) report["image_period"] = *period_ms;
    std::cout << report.dump(2) << '\n';
    return;
  }
  std::cout << fmt::format("  {:<34}{:>9}{:>9}{:>9}{:>9}{:>8}\n", "ms", "p50", "p90", "p99", "max", "n")
            << line_of("flash to here", latency.to_shape_ms())
            << fmt::format("   {:.3f} mm\n",
                           quantile(latency.to_shape_ms(), 0.5) / 1000 * arguments.speed_mm_s);
  if (!latency.to_stamp_ms().empty())
    std::cout << line_of("flash to the image's stamp", latency.to_stamp_ms()) << '\n';
  if (late_ms) {
    std::cout << fmt::format(
        "stamps are {:.1f} ms late against the light (flashes wait {:.1f} ms for the next image, in the "
        "mean): add that to time_offset_ms of [[camera]]\n",
        *late_ms, *latency.period_ms() / 2);
  }
}

void tell_why_nothing(const FlashLatency& latency, bool has_samples, const Subscription& subscription) {
  if (!has_samples) {
    std::cerr << "tubectl: no estimate\n";
    SilenceTeller(subscription, "latency").tell();
  } else if (latency.flashes() == 0) {
    std::cerr << "tubectl: the daemon takes no image of the noise, so that nothing was flashed: does its "
                 "camera see this "
                 "screen, and most of it (crop)? `tubectl status` says what it gets\n";
  } else {
    std::cerr
        << "tubectl: none of " << latency.flashes()
        << " flashes was noticed: a white image is refused when more than half of its pixels are saturated; "
           "has the camera white_level, range = \"limited\", a crop beyond the screen?\n";
  }
}

}  // namespace

int measure_glass(const GlassArguments& arguments, const Subscription& subscription) {
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGHUP}) {  // before the screen is taken
    std::signal(signal, [](int) { g_asked_to_end = 1; });
  }
  std::unique_ptr<TestScreen> screen =
      arguments.where == "terminal"
          ? terminal_screen()
          : grabber_screen(arguments.where, arguments.camera, arguments.size_px[0], arguments.size_px[1]);
  TubeSubscriber subscriber(subscription, Delivery::kEvery);
  FlashLatency latency;
  bool has_samples = false;
  std::string instrument;  // the first that is heard: all have the same images
  const MonotonicTime start = monotonic_now();
  const MonotonicTime until =
      start + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * arguments.duration_s));
  FlashSchedule schedule(start);
  for (MonotonicTime now = start; now < until && g_asked_to_end == 0; now = monotonic_now()) {
    schedule.step(now, *screen, latency);
    const TubeNews news = subscriber.wait_for(milliseconds{2});
    if (news.sample == nullptr) continue;
    instrument = has_samples ? instrument : std::string(news.instrument_id);
    has_samples = true;
    if (news.instrument_id == instrument) latency.add(flash_sample(*news.sample));
  }
  screen.reset();  // words are for the screen that was there before
  if (latency.to_shape_ms().empty()) {
    tell_why_nothing(latency, has_samples, subscription);
    return kExitUnavailable;
  }
  print(latency, arguments);
  return kExitOk;
}

}  // namespace tubed
