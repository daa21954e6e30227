// The newest image of a demonstration, out of the daemon's preview.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/pictures/grey_picture.hpp"
#include "idl/geometry/view_geometry.hpp"
#include "idl/shm_reader.hpp"

namespace tubed {

/// Reads one camera's images as they come. One thread.
class DemoImage {
 public:
  /// `socket`: of the daemon's preview, which need not be there yet.
  explicit DemoImage(std::string socket) : socket_(std::move(socket)) {}

  /// Takes what is new. Never waits.
  void look(std::int64_t now_ns);

  /// The newest picture; nothing before the first, and while fluoroscopy is off or no image has come for half
  /// a second.
  [[nodiscard]] const GreyPicture* picture(std::int64_t now_ns) const;
  /// How the view stood for it; nothing: as the configuration says.
  [[nodiscard]] const std::optional<ViewGeometry>& geometry() const { return geometry_; }

 private:
  void connect(std::int64_t now_ns);

  std::string socket_;
  std::optional<ShmReader> reader_;
  std::int64_t next_try_ns_ = 0;
  GreyFollower follower_;
  GreyPicture picture_;
  std::optional<ViewGeometry> geometry_;
  std::int64_t came_ns_ = 0;
};

}  // namespace tubed
