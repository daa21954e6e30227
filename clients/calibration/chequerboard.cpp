#include "clients/calibration/chequerboard.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace tubed {

namespace {

/// OpenCV wants 8 bit; the darkest and brightest 1 % are cut.
cv::Mat eight_bit(const CalibrationPicture& picture) {
  std::vector<float> sorted = picture.pixels;
  const auto part = [&](double share) {
    const auto at =
        sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return static_cast<double>(*at);
  };
  const double dark = part(0.01);
  const double bright = std::max(dark + 1, part(0.99));
  cv::Mat grey(picture.height, picture.width, CV_8U);
  std::transform(picture.pixels.begin(), picture.pixels.end(), grey.ptr<std::uint8_t>(), [&](float value) {
    return static_cast<std::uint8_t>(
        std::clamp((static_cast<double>(value) - dark) / (bright - dark) * 255, 0.0, 255.0));
  });
  return grey;
}

}  // namespace

Eigen::Vector3d Chequerboard::p_board_mm(std::size_t corner) const {
  const auto row_length = static_cast<std::size_t>(columns);
  return {square_mm * static_cast<double>(corner % row_length),
          square_mm * static_cast<double>(corner / row_length), 0};
}

std::optional<std::vector<CameraPoint>> find_board(const CalibrationPicture& picture,
                                                   const Chequerboard& board) {
  const cv::Mat grey = eight_bit(picture);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(grey, {board.columns, board.rows}, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return std::nullopt;
  }
  double min_px = 1e9;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    min_px = std::min(min_px, cv::norm(corners[i] - corners[i - 1]));
  }
  const int reach_px = std::clamp(static_cast<int>(0.35 * min_px), 2, 11);
  cv::cornerSubPix(grey, corners, {reach_px, reach_px}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 1e-4));
  std::vector<CameraPoint> points;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    constexpr double kCornerSigma_px = 0.05;
    points.push_back({board.p_board_mm(i), 0, {corners[i].x, corners[i].y}, kCornerSigma_px, i});
  }
  return points;
}

std::optional<Intrinsics> first_guess(std::vector<PointView>& views, int width, int height) {
  std::vector<std::vector<cv::Point3f>> object;
  std::vector<std::vector<cv::Point2f>> image;
  for (const PointView& view : views) {
    object.emplace_back();
    image.emplace_back();
    for (const CameraPoint& point : view.points) {
      object.back().emplace_back(
          cv::Point3d(point.p_world_mm.x(), point.p_world_mm.y(), point.p_world_mm.z()));
      image.back().emplace_back(cv::Point2d(point.p_image_px.x(), point.p_image_px.y()));
    }
  }
  const cv::Mat K = cv::initCameraMatrix2D(object, image, {width, height}, 1.0);
  const Intrinsics guess{K.at<double>(0, 0), 1, (width - 1) / 2.0, (height - 1) / 2.0, {}};
  if (!std::isfinite(guess.fx) || guess.fx < 1) return std::nullopt;
  for (std::size_t i = 0; i < views.size(); ++i) {
    cv::Vec3d turn;
    cv::Vec3d shift;
    if (!cv::solvePnP(object[i], image[i], K, cv::noArray(), turn, shift)) return std::nullopt;
    const Eigen::Vector3d w(turn[0], turn[1], turn[2]);
    views[i].T_camera_world = RigidTransform::Identity();
    if (w.norm() > 0) {
      views[i].T_camera_world.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    }
    views[i].T_camera_world.translation() = Eigen::Vector3d(shift[0], shift[1], shift[2]);
  }
  return guess;
}

}  // namespace tubed
