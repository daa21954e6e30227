// tubectl calibrate view: where a view stands that moved without a word.
#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <optional>

#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/found_view.hpp"
#include "clients/cpp/tube_subscriber.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_camera.hpp"
#include "clients/tubectl/calibrate/coil_source.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "daemon/config/load_configuration.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

struct ViewOptions {
  std::string recording;  ///< empty: what runs
  std::string camera;     ///< empty: the one that moved
  double seconds = 10;
  Subscription subscription;
  AcceptOptions accept;
};

/// What FoundViewSearch reads of it.
TubeEstimate estimate_of(const tubed_TubeEstimate& sample) {
  TubeEstimate estimate;
  estimate.reasons = Reasons(sample.reasons);
  estimate.valid_time_ns = sample.valid_time_monotonic_ns;
  estimate.view_count = std::min<std::uint32_t>(sample.view_count, kMaxCameras);
  for (std::uint32_t i = 0; i < estimate.view_count; ++i) {
    const tubed_ViewUsed& from = sample.views[i];
    ViewUsed& view = estimate.views[i];
    view.camera = from.camera;
    view.has_own_geometry = from.has_own_geometry;
    std::copy_n(from.focal_length_px, 2, view.focal_length_px.begin());
    std::copy_n(from.principal_point_px, 2, view.principal_point_px.begin());
    std::copy_n(from.T_camera_world, 16, view.T_camera_world.begin());
    std::copy_n(from.sigma_rotation_rad, 3, view.sigma_rotation_rad.begin());
    std::copy_n(from.sigma_translation_mm, 3, view.sigma_translation_mm.begin());
  }
  return estimate;
}

/// The newest that comes within `seconds`.
FoundView listen(const ViewOptions& options) {
  if (options.accept.config.empty()) {
    throw CalibrationError("--config: the daemon's configuration is needed, which names its cameras");
  }
  const RoomDescription room = load_configuration(options.accept.config).room;
  TubeSubscriber subscriber(options.subscription);
  const auto until = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                               std::chrono::duration<double>(options.seconds));
  FoundViewSearch search(room, options.camera);
  bool has_heard = false;
  while (steady_clock::now() < until) {
    const TubeNews news = subscriber.wait_for(milliseconds{100});
    if (news.sample == nullptr) continue;
    const TubeEstimate estimate = estimate_of(news.sample->estimate);
    has_heard = true;
    const bool are_known =
        std::all_of(estimate.views.begin(), estimate.views.begin() + estimate.view_count,
                    [&](const ViewUsed& view) { return view.camera < room.cameras.size(); });
    if (!are_known) {
      throw CalibrationError(options.accept.config +
                             " is not the configuration of the daemon that is heard: it has fewer cameras");
    }
    search.take(estimate);
  }
  if (search.found()) return *search.found();
  throw CalibrationError(
      !has_heard ? "no shapes were heard; `tubectl status` says why"
      : search.has_moved()
          ? "the view moved, and where to is not found yet: keep the catheter in view, moving, for "
            "twenty seconds; without a change of its pose the view counts as lost"
          : "no view has moved: every shape that was heard uses the poses that are given");
}

int calibrate(const ViewOptions& options) {
  const FoundView found =
      options.recording.empty()
          ? listen(options)
          : find_view(read_recording(options.recording, options.accept.config), options.camera);
  return offer(fragment_of(found), options.accept);
}

}  // namespace

CommandLine add_calibrate_view(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<ViewOptions>();
  CommandLine verb = app.add_subcommand(
      "view",
      "The pose of a view after a move that nobody announced, as coils and images have found it: from the "
      "daemon that runs, or from a recording");
  verb.add_option("RECORDING", options->recording,
                  "Sequence folder, format 1, with images; left out: the daemon that runs");
  verb.add_option("--camera", options->camera, "Only this one");
  verb.add_option("--seconds", options->seconds, "How long to listen to a daemon")
      .in_range(1.0, 3600.0)
      .capture_default_str();
  add_dds_options(verb, options->subscription);
  add_accept_options(verb, options->accept);
  verb.footer("Example:\n  tubectl calibrate view --config /etc/tubed/tubed.toml");
  verb.callback([options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate(*options); }); });
  return verb;
}

}  // namespace tubed
