#pragma once

#include "daemon/image/view_follower.hpp"
#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/stage.hpp"
#include "daemon/pipeline/triple_buffer.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Where the grab stage leaves a copy of each exposure for the view's watch. Without one nobody watches.
struct ViewInlet {
  TripleBuffer<ImageFrame>* frames = nullptr;
  Doorbell* bell = nullptr;

  /// Copies an exposure of the size that the slots were reserved for, and rings; leaves out any other, and
  /// instants without radiation. Never allocates.
  void offer(const ImageFrame& frame) const noexcept;
};

/// Asks of each exposure of one camera whether the view is still where its pose says. It runs beside the
/// Frangi stage, at low priority, and looks at the newest exposure only: a verdict that comes late is of the
/// next image. See Stage.
class ViewStage final : public Stage {
 public:
  ViewStage(const CameraCalibration& camera, TripleBuffer<ImageFrame>& from_grab,
            TripleBuffer<ViewVerdict>& to_optimizer, Doorbell& own_bell,
            TripleBuffer<ViewGeometry>* configured = nullptr)
      : camera_(camera),
        watch_(camera),
        from_grab_(from_grab),
        to_optimizer_(to_optimizer),
        bell_(own_bell),
        configured_(configured) {}

  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(clock.now() + std::chrono::milliseconds(100));
  }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { bell_.ring(); }
  /// Everything else comes first on a busy machine.
  [[nodiscard]] std::chrono::nanoseconds max_silence() const noexcept override {
    return std::chrono::seconds(2);
  }
  void describe(StageReport& report) const noexcept override;

 private:
  [[nodiscard]] const ViewGeometry* geometry_of_newest() noexcept;

  CameraCalibration camera_;
  ViewFollower watch_;
  TripleBuffer<ImageFrame>& from_grab_;
  TripleBuffer<ViewVerdict>& to_optimizer_;
  Doorbell& bell_;
  TripleBuffer<ViewGeometry>* configured_;        ///< changes of the configuration's; nullptr: none come
  ViewGeometry geometry_ = geometry_of(camera_);  ///< of images without one of their own
  UnjudgedView told_ = UnjudgedView::kLearning;   ///< the newest that lasts: not moving blades
  std::uint64_t outputs_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace tubed
