// Images for viewers into shared memory.
#pragma once

#include <memory>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/pipeline/preview_tap.hpp"
#include "daemon/publishing/shm_image_publisher.hpp"

namespace tubed {

/// One socket a camera. All calls come from the preview thread.
class ShmPreviewOutlet final : public PreviewOutlet {
 public:
  /// Throws ShmError.
  explicit ShmPreviewOutlet(const Configuration& configuration);

  void put(std::size_t camera, const ImageFrame& frame) noexcept override;
  void beat() noexcept override;

 private:
  struct Preview {
    std::unique_ptr<ShmImagePublisher> publisher;
    CameraCalibration camera;
  };
  std::vector<Preview> previews_;  ///< in the order of the room's cameras
};

/// As viewers get it: origin, time of exposure and, where the daemon uses it, how the view stood stay what
/// the source said. `camera`: as configured.
tubed_shm_image described(const ImageFrame& frame, const CameraCalibration& camera);

}  // namespace tubed
