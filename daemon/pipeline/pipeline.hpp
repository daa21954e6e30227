// All hand-overs, stages and threads of the daemon in one object.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "daemon/pipeline/pipeline_settings.hpp"
#include "daemon/pipeline/preview_tap.hpp"
#include "daemon/pipeline/publisher_stage.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// What a pipeline is made of.
struct PipelineParts {
  std::unique_ptr<EmSource> em_source;
  std::vector<std::unique_ptr<ImageSource>> image_sources;  ///< one a camera of the room, in its order
  std::vector<std::unique_ptr<Estimator>> estimators;       ///< one an instrument of the room, in its order
};

/// Made, started and destroyed by the main thread. Destruction stops the threads in the order of the data.
class Pipeline {
 public:
  /// `outlet` and `previews` outlive the pipeline; `previews` null: images go nowhere else. Throws
  /// std::invalid_argument when parts and room do not fit each other.
  Pipeline(PipelineParts parts, const RoomDescription& room, const FrangiSettings& frangi,
           const PipelineSettings& settings, Outlet& outlet, PreviewOutlet* previews = nullptr);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Starts all threads. Throws std::runtime_error when scheduling was refused and is not optional; returns
  /// the refusals, one a thread, when it is.
  std::vector<std::string> start();

  /// From the next image on, images of that camera that bring no geometry of their own were taken with this
  /// one. By the main thread, while the threads run.
  void look_from(std::size_t camera, const ViewGeometry& configured);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tubed
