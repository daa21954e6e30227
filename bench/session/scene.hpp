// What a measured daemon sees: the simulated catheter in the arch, drawn before the session begins so that
// nothing is simulated while latencies are taken.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/laboratory/simulated_tracker.hpp"
#include "drivers/laboratory/simulated_world.hpp"

namespace tubed {

struct SceneSettings {
  double rate_hz = 30;  ///< exposures a second
  int width = 400;      ///< px
  int height = 600;
  int cameras = 1;      ///< 1 or 2: from the front, from the side
  int instruments = 1;  ///< the one catheter, tracked so many times
  int coefficient_count = 26;
  std::string frangi_area = "band";  ///< [frangi] area
  double em_rate_hz = 40;
};

/// Pictures of some seconds, which are shown to and fro, and the coils' measurements along the same motion.
class Scene {
 public:
  explicit Scene(const SceneSettings& settings);

  [[nodiscard]] const SceneSettings& settings() const { return settings_; }
  [[nodiscard]] const RoomDescription& room() const { return room_; }
  /// Picture of exposure number k (from 0), 8 bit, row by row.
  [[nodiscard]] const std::vector<std::uint8_t>& picture(int camera, std::int64_t k) const;
  /// Measurement number k (from 0) of all coils, taken k / em_rate_hz after exposure 0; its times are that.
  [[nodiscard]] EmFrame measurement(std::int64_t k) const;
  /// Writes a sequence folder whose em.csv lasts `duration_s`: what the daemon's replay driver reads.
  void write_em(const std::filesystem::path& folder, double duration_s) const;

 private:
  [[nodiscard]] double scene_time_s(double t_s) const;

  SceneSettings settings_;
  RoomDescription room_;
  SimulatedWorld world_;
  SimulatedTracker tracker_;
  std::int64_t distinct_ = 0;  ///< pictures of each camera
  std::vector<std::vector<std::vector<std::uint8_t>>> pictures_;
};

/// Socket of a camera's images in the session's folder.
std::string image_socket(const std::filesystem::path& folder, const CameraCalibration& camera);
/// Socket of the estimates.
std::string estimates_socket(const std::filesystem::path& folder);

/// Configuration of a daemon that tracks the scene: EM from `folder`/em, images from the sockets, estimates
/// to DDS `domain` and shared memory. `start_ns`: CLOCK_MONOTONIC of exposure 0.
std::string scene_configuration(const Scene& scene, const std::filesystem::path& folder, int domain,
                                std::int64_t start_ns);

}  // namespace tubed
