// A chequerboard before an optical camera.
#pragma once

#include <optional>

#include "clients/calibration/calibration_picture.hpp"
#include "clients/calibration/camera_fit.hpp"

namespace tubed {

/// Inner corners: where four squares meet. Frame of the board: x along a row of corners, y from row to row,
/// origin at the first corner.
struct Chequerboard {
  int columns = 0;
  int rows = 0;
  double square_mm = 0;

  [[nodiscard]] Eigen::Vector3d p_board_mm(std::size_t corner) const;
};

/// Corners to a fraction of a pixel (OpenCV), row by row; nothing when not all can be seen.
std::optional<std::vector<CameraPoint>> find_board(const CalibrationPicture& picture,
                                                   const Chequerboard& board);

/// A first guess at the camera from all views (Zhang, PAMI 22, 2000), poses set in `views`. Nothing when the
/// views do not allow it.
std::optional<Intrinsics> first_guess(std::vector<PointView>& views, int width, int height);

}  // namespace tubed
