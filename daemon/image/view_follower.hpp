// Where does a view stand after it moved, and does it stand still there?
#pragma once

#include "daemon/image/view_watch.hpp"

namespace tubed {

/// A ViewWatch of the place whose pose is known, and, while the view is not there, another one of the place
/// where it is: a view that has settled can be found again, and when it moves again that is said. One thread;
/// memory is taken in the constructor, observe() never allocates.
class ViewFollower {
 public:
  /// As ViewWatch.
  ViewFollower(int width, int height, double mm_per_px)
      : given_(width, height, mm_per_px), here_(width, height, mm_per_px) {}
  explicit ViewFollower(const CameraCalibration& camera) : given_(camera), here_(camera) {}

  /// See ViewWatch.
  void look_from(const ViewGeometry& geometry, MonotonicTime now) { given_.look_from(geometry, now); }

  /// The verdict of the watch of the known place, with `moves` and `has_settled`.
  const ViewVerdict& observe(const ImageFrame& frame);

  [[nodiscard]] const ViewVerdict& newest() const { return verdict_; }

 private:
  void follow(const ImageFrame& frame);

  ViewWatch given_;
  ViewWatch here_;
  bool is_elsewhere_ = false;
  ViewVerdict verdict_;
};

}  // namespace tubed
