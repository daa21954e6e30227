// What a person asks of `tubectl demo`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/tubectl/see/demo_daemon.hpp"

namespace tubed {

struct DemoOptions {
  double headless_s = 0;
  std::string json;
  std::string picture;
  int domain = -1;
  std::int64_t seed = 1;
  std::string preset = "field";
  std::string tracker = "simulation";
  std::string can_interface;
  std::vector<std::string> mistakes;
  bool web = false;
  std::string listen = "127.0.0.1:8080";
  std::string vessel;
  std::string points;
};

/// What `--tracker` may be: in a build for the demonstration alone (TUBED_DEMO_ONLY) the simulated one only.
[[nodiscard]] std::vector<std::string> demo_trackers();

/// The room that these options describe, from now on. Throws std::runtime_error for a CAN interface that
/// cannot be used.
[[nodiscard]] DemoScene scene_of(const DemoOptions& options);

}  // namespace tubed
