#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "drivers/interface/image_source.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "drivers/simulation/fault_socket.hpp"
#include "drivers/simulation/sample_clock.hpp"

namespace tubed {

/// One view of a fluoroscope that looks at the simulated world. Called by that view's image grab thread. What
/// exposure k shows is a pure function of the settings and k (but for the detector lag of "clinical"). A late
/// reader gets the newest exposure due, the others are lost.
class SimulatedImageSource final : public ImageSource {
 public:
  SimulatedImageSource(const RoomDescription& room, const DriverSettings& settings, int camera_index);

  OpenResult open() override;
  void wait(MonotonicTime deadline) noexcept override;
  ReadOutcome read(ImageFrame& frame) noexcept override;
  void close() noexcept override;

 private:
  void fill(ImageFrame& frame) noexcept;
  /// Does the preset radiate at exposure k?
  [[nodiscard]] bool exposed(std::int64_t k) const noexcept;

  SimulatedWorld world_;
  CameraCalibration camera_;  ///< as it is, whatever was described
  SampleClock clock_;
  std::chrono::nanoseconds stamp_error_;
  std::int64_t seed_;
  double cnr_;
  std::unique_ptr<SimulatedView> view_;  ///< made by the first open(): the rays of a chest take seconds
  std::string control_folder_;
  FaultSocket control_;
  Faults faults_;
  std::int64_t next_ = 0;   ///< exposure to deliver next
  std::int64_t shown_ = 0;  ///< exposure that was drawn last: a stuck fluoroscope repeats it
  bool is_open_ = false;
};

}  // namespace tubed
