#include "drivers/simulation/simulated_image_source.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

/// Late stamps come from a delay that nobody knows of: what is stamped late is delivered late. A preset may
/// expose the second view with every n-th exposure of the first only.
SampleClock image_clock(const DriverSettings& settings, const SimulatedWorld& world, int camera_index) {
  const Scenario* scenario = world.scenario();
  const int every = scenario == nullptr || camera_index == 0 ? 1 : scenario->second_view_every;
  return {from_ns(settings.get<std::int64_t>("epoch_ns")), settings.get<double>("frame_rate_hz") / every,
          settings.get<double>("image_latency_ms") + 1e3 * world.mistakes().image_stamp_error_s()};
}

}  // namespace

SimulatedImageSource::SimulatedImageSource(const RoomDescription& room, const DriverSettings& settings,
                                           int camera_index)
    : world_(room, settings),
      camera_(world_.room().cameras.at(static_cast<std::size_t>(camera_index))),
      clock_(image_clock(settings, world_, camera_index)),
      stamp_error_(std::llround(1e9 * world_.mistakes().image_stamp_error_s())),
      seed_(settings.get<std::int64_t>("seed")),
      cnr_(settings.get<double>("cnr")),
      control_folder_(settings.get<std::string>("control_folder")) {}

OpenResult SimulatedImageSource::open() {
  if (!control_folder_.empty()) {
    OpenResult bound = control_.open(control_folder_, "image-" + camera_.name + ".sock");
    if (!bound.ok) {
      return bound;
    }
  }
  if (view_ == nullptr) {
    view_ = std::make_unique<SimulatedView>(camera_, world_, seed_, cnr_, nullptr,
                                            control_folder_.empty() ? PanOnRequest::kNo : PanOnRequest::kYes);
  }
  next_ = clock_.first_after(monotonic_now());
  is_open_ = true;
  return {true, {}};
}

void SimulatedImageSource::close() noexcept {
  control_.close();
  is_open_ = false;
}

void SimulatedImageSource::wait(MonotonicTime deadline) noexcept {
  if (is_open_) {
    sleep_until(std::max(clock_.due(next_), faults_.stalled_until), deadline);
  }
}

ReadOutcome SimulatedImageSource::read(ImageFrame& frame) noexcept {
  if (!is_open_) {
    return ReadOutcome::kLost;
  }
  const MonotonicTime now = monotonic_now();
  control_.poll(now, faults_);
  next_ = clock_.after_stall(next_, faults_.stalled_until, now);
  if (now < faults_.stalled_until || now < clock_.due(next_)) {
    return ReadOutcome::kNothing;
  }
  next_ = clock_.newest_due(now);
  if (frame.pixels.size() < view_->bytes_per_image()) {
    ++next_;
    return ReadOutcome::kRefused;
  }
  fill(frame);
  ++next_;
  return ReadOutcome::kFrame;
}

bool SimulatedImageSource::exposed(std::int64_t k) const noexcept {
  const Scenario* scenario = world_.scenario();
  return scenario == nullptr ||
         scenario->fluoroscopy_on(world_.scenario_time_s(world_.seconds(clock_.taken(k))));
}

void SimulatedImageSource::fill(ImageFrame& frame) noexcept {
  shown_ = faults_.stuck ? shown_ : next_;
  frame.exposure = clock_.taken(next_) + stamp_error_;
  frame.frame_number = static_cast<std::uint32_t>(next_);
  frame.origin = Origin::kSimulated;
  frame.fluoroscopy_on = !faults_.fluoroscopy_off && exposed(next_);
  frame.width = camera_.width;
  frame.height = camera_.height;
  frame.depth = view_->depth();
  frame.geometry = world_.announced(camera_, world_.seconds(clock_.taken(shown_)), shown_, seed_);
  const std::span<std::uint8_t> pixels(frame.pixels.data(), view_->bytes_per_image());
  if (faults_.black) {
    std::fill(pixels.begin(), pixels.end(), std::uint8_t{0});
  } else if (frame.fluoroscopy_on) {
    view_->pan_table(faults_.pan_mm);
    view_->render(world_, world_.seconds(clock_.taken(shown_)), shown_, pixels);
  }
  frame.received = monotonic_now();
}

}  // namespace tubed
