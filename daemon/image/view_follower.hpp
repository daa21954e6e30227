// Where does a view stand after it moved, and does it stand still there?
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "daemon/image/view_key.hpp"
#include "daemon/image/view_watch.hpp"

namespace tubed {

/// A ViewWatch of the place whose pose is known, and, while the view is not there, a few keys of the place
/// where it is: a view that has settled can be found again, and when it moves again that is said. One thread;
/// memory is taken in the constructor, observe() never allocates.
class ViewFollower {
 public:
  /// As ViewWatch.
  ViewFollower(int width, int height, double mm_per_px) : ViewFollower(ViewWatch(width, height, mm_per_px)) {}
  explicit ViewFollower(const CameraCalibration& camera) : ViewFollower(ViewWatch(camera)) {}

  /// See ViewWatch.
  void look_from(const ViewGeometry& geometry, MonotonicTime now) { given_.look_from(geometry, now); }

  /// The verdict of the watch of the known place, with `moves`, `has_settled` and `is_suspect_here`.
  const ViewVerdict& observe(const ImageFrame& frame);

  [[nodiscard]] const ViewVerdict& newest() const { return verdict_; }

  static constexpr std::size_t kMaxKeys = 10;

 private:
  /// A view of the background where the view is now.
  struct Key {
    ViewKey key;
    MonotonicTime seen{};
  };
  struct Known {
    double share = 0;      ///< of still blocks, against the key that fits best
    MonotonicTime seen{};  ///< that key
  };

  // What an image shows as one did that long ago stands still, or has come back: a slow pan does neither.
  static constexpr std::chrono::milliseconds kSettled{1000};
  // One and a half breaths; later newcomers could carry the keys along with a slow pan.
  static constexpr std::chrono::milliseconds kLearning{6000};
  // Shares as those of ViewWatch.
  static constexpr double kKnown = 0.6;
  static constexpr double kMoved = 0.35;
  static constexpr int kMovedInARow = 3;

  explicit ViewFollower(ViewWatch given);

  void begin_place(MonotonicTime now);
  void follow(MonotonicTime now);
  [[nodiscard]] Known compare();
  void learn(MonotonicTime now);

  ViewWatch given_;
  std::vector<Key> keys_;
  std::size_t used_ = 0;  ///< of keys_
  MonotonicTime began_{};
  int bad_in_a_row_ = 0;
  bool is_elsewhere_ = false;
  ViewVerdict verdict_;
};

}  // namespace tubed
