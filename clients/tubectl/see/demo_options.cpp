#include "clients/tubectl/see/demo_options.hpp"

#include <chrono>

#ifndef TUBED_DEMO_ONLY  // the simulated tracker alone, without the drivers of others
#include "clients/tubectl/see/can_layout.hpp"
#endif
#include "drivers/interface/timestamps.hpp"

namespace tubed {

namespace {

/// What tubed-view is told of files.
std::vector<std::string> web_options(const DemoOptions& options) {
  std::vector<std::string> words;
  if (!options.vessel.empty()) words.insert(words.end(), {"--vessel", options.vessel});
  if (!options.points.empty()) words.insert(words.end(), {"--points", options.points});
  return words;
}

DemoTracker tracker_named(const std::string& name) {
  return name == "aurora-serial" ? DemoTracker::kAuroraSerial
         : name == "aurora-can"  ? DemoTracker::kAuroraCan
                                 : DemoTracker::kSimulation;
}

#ifdef TUBED_DEMO_ONLY
const std::vector<std::string> kTrackers{"simulation"};
std::string layout_for(const DemoOptions&) { return ""; }
#else
const std::vector<std::string> kTrackers{"simulation", "aurora-serial", "aurora-can"};
std::string layout_for(const DemoOptions& options) {
  return options.tracker == "aurora-can" ? can_layout(options.can_interface) : "";
}
#endif

}  // namespace

std::vector<std::string> demo_trackers() { return kTrackers; }

DemoScene scene_of(const DemoOptions& options) {
  return {.domain = options.domain,
          .epoch_ns = to_ns(std::chrono::steady_clock::now()),
          .seed = options.seed,
          .preset = options.preset,
          .tracker = tracker_named(options.tracker),
          .can_interface = options.can_interface,
          .can_layout = layout_for(options),
          .mistakes = options.mistakes,
          .web = options.web ? options.listen : "",
          .shows_images = options.web || options.headless_s == 0,
          .web_options = web_options(options)};
}

}  // namespace tubed
