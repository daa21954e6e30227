// A second look at poses that the check sum let through: a coil cannot be somewhere else 25 ms later.
#pragma once

#include <array>

#include "drivers/interface/em_source.hpp"

namespace tubed::aurora {

/// Compares each measurement with the last one that was believed. A 16-bit check sum lets 1 of 65536 damaged
/// replies through; most of those put a coil far away. One thread; no allocation.
class PoseGuard {
 public:
  /// A coil that turns up within these of where it was is believed at once. A catheter is pushed by hand:
  /// recorded coils moved 5 mm (median) and 12 mm (95 %) in 25 ms.
  static constexpr double kLeapMm = 60;
  static constexpr double kSpeedMmPerSecond = 1500;
  static constexpr double kLeapCosine = 0.5;  ///< of the axis: 60 degrees

  void reset() noexcept { *this = PoseGuard(); }

  /// Whether `frame` may be believed. A leap is refused once: when the next measurement agrees with it, it
  /// was true. After half a second without a pose a coil may be anywhere.
  [[nodiscard]] bool believe(const EmFrame& frame) noexcept;

 private:
  struct Seen {
    bool known = false;
    MonotonicTime time{};
    Eigen::Vector3d p_em_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d tangent_em = Eigen::Vector3d::Zero();
  };
  using Coils = std::array<Seen, kMaxTrackerCoils>;

  static bool agrees(const EmFrame& frame, const Coils& with) noexcept;
  static void remember(const EmFrame& frame, Coils& coils) noexcept;

  Coils believed_;
  Coils doubted_;
  bool in_doubt_ = false;
};

}  // namespace tubed::aurora
