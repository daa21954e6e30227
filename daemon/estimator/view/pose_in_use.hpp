// A pose that was found, from when its images are used: when is it given up, and what can still be learnt?
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Called by the optimizer thread; memory is taken in the constructor.
class PoseInUse {
 public:
  explicit PoseInUse(Eigen::Index line_count);

  /// Another pose, with the image of `exposure`.
  void begin(MonotonicTime exposure);

  /// An image that was used with it. `is_good`: it showed the tube there; `says_something`: it would have,
  /// were the pose right. False when the pose has not been good for a second: it was wrong, or the view moved
  /// slowly.
  bool note(MonotonicTime exposure, bool is_good, bool says_something);

  /// 0 to 1: is the tube elsewhere than at each of the 16 places at which the pose was refined last?
  [[nodiscard]] double news_of(const Eigen::Matrix3Xd& points_mm) const;
  void note_refined_at(const Eigen::Matrix3Xd& points_mm);

 private:
  std::array<Eigen::Matrix3Xd, 16> refined_at_mm_;  ///< where the tube was
  std::size_t refined_ = 0;                         ///< how often that was
  MonotonicTime bad_since_{};
  MonotonicTime last_use_{};
};

}  // namespace tubed
