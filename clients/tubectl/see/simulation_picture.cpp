#include "clients/tubectl/see/simulation_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "clients/tubectl/see/picture_file.hpp"
#include "drivers/laboratory/vessel/vessel_file.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

namespace {

constexpr int kPanelWidth_px = 270;
constexpr int kPanelHeight_px = 405;
constexpr int kPlotHeight_px = 96;
constexpr int kMargin_px = 8;
const cv::Scalar kBlack(20, 20, 20);
const cv::Scalar kCatheter(40, 60, 220);  // blue, green, red
const cv::Scalar kCoil(20, 140, 255);
const cv::Scalar kCurve(160, 80, 20);

cv::Point in_panel(const Camera& camera, const Eigen::Vector3d& p_world_mm) {
  const auto projected = camera.project(p_world_mm);
  const double scale = static_cast<double>(kPanelWidth_px) / camera.calibration().width;
  return projected ? cv::Point(static_cast<int>(std::lround(scale * projected->p_image_px.x())),
                               static_cast<int>(std::lround(scale * projected->p_image_px.y())))
                   : cv::Point(-1000, -1000);
}

/// Length of each ray in the lumen, as brightness.
cv::Mat vessel_seen_by(const Camera& camera, const WallField& wall) {
  constexpr double kStep_mm = 1.5;
  constexpr double kDeepest_mm = 45;
  const RigidTransform T_world_camera = camera.calibration().T_camera_world.inverse();
  const Eigen::AlignedBox3d box = wall.box_world_mm().transformed(camera.calibration().T_camera_world);
  const double scale = static_cast<double>(camera.calibration().width) / kPanelWidth_px;
  cv::Mat panel(kPanelHeight_px, kPanelWidth_px, CV_8UC3);
  for (int y = 0; y < panel.rows; ++y) {
    for (int x = 0; x < panel.cols; ++x) {
      const Eigen::Vector3d ray = camera.ray_camera({scale * x, scale * y});
      double inside_mm = 0;
      for (double depth_mm = box.min().z(); depth_mm < box.max().z(); depth_mm += kStep_mm) {
        inside_mm += wall.distance_mm(T_world_camera * (depth_mm * ray)) > 0 ? kStep_mm : 0;
      }
      const double share = std::min(inside_mm / kDeepest_mm, 1.0);
      const auto grey = static_cast<unsigned char>(250 - 110 * std::sqrt(share));
      panel.at<cv::Vec3b>(y, x) = {grey, static_cast<unsigned char>(grey - 8 * share), grey};
    }
  }
  return panel;
}

void draw_text(cv::Mat& image, const std::string& text, cv::Point at) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.4, kBlack, 1, cv::LINE_AA);
}

cv::Mat panel_at(const cv::Mat& vessel, const Camera& camera, const CatheterShape& shape,
                 const InstrumentDescription& catheter, std::size_t step) {
  cv::Mat panel = vessel.clone();
  std::vector<cv::Point> points;
  for (double s_mm = 0; s_mm <= catheter.length_mm; s_mm += 1) {
    points.push_back(in_panel(camera, shape.at(s_mm).p_world_mm));
  }
  cv::polylines(panel, points, false, kCatheter, 2, cv::LINE_AA);
  for (const CoilPlacement& coil : catheter.coils) {
    cv::circle(panel, in_panel(camera, shape.at(coil.offset_from_tip_mm).p_world_mm), 4, kCoil, cv::FILLED,
               cv::LINE_AA);
  }
  draw_text(panel, "step " + std::to_string(step), {6, 14});
  cv::rectangle(panel, {0, 0}, {panel.cols - 1, panel.rows - 1}, kBlack);
  return panel;
}

/// One value a step, on a scale that reaches from 0 to `greatest`.
cv::Mat plot(const std::vector<double>& values, double greatest, const std::string& title, int width_px) {
  cv::Mat image(kPlotHeight_px, width_px, CV_8UC3, cv::Scalar(255, 255, 255));
  std::vector<cv::Point> points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double share = std::min(values[i] / greatest, 1.0);
    points.emplace_back(static_cast<int>(static_cast<double>(i * static_cast<std::size_t>(width_px)) /
                                         static_cast<double>(values.size())),
                        static_cast<int>(std::lround((kPlotHeight_px - 4) * (1 - share))) + 1);
  }
  cv::polylines(image, points, false, kCurve, 1, cv::LINE_AA);
  draw_text(image, title, {6, 14});
  cv::rectangle(image, {0, 0}, {image.cols - 1, image.rows - 1}, kBlack);
  return image;
}

void place(cv::Mat& page, const cv::Mat& part, int x, int y) {
  part.copyTo(page(cv::Rect(x, y, part.cols, part.rows)));
}

}  // namespace

void draw_simulation(const Scenario& scenario, const Catheterisation& run,
                     const std::filesystem::path& file) {
  const Vessel vessel =
      scenario.vessel_file.empty() ? make_aorta(scenario.patient) : read_vessel(scenario.vessel_file);
  const Camera camera(scenario.room.cameras.front());
  const cv::Mat seen = vessel_seen_by(camera, vessel.wall);
  const int width = 4 * kPanelWidth_px + 5 * kMargin_px;
  cv::Mat page(kPanelHeight_px + 3 * kPlotHeight_px + 5 * kMargin_px, width, CV_8UC3,
               cv::Scalar(255, 255, 255));
  const std::size_t last = run.shapes.size() - 1;
  int x = kMargin_px;
  for (const std::size_t step : {std::size_t{0}, last * 2 / 5, last * 2 / 3, last}) {
    place(page, panel_at(seen, camera, run.shapes[step], scenario.room.instruments.front(), step), x,
          kMargin_px);
    x += kPanelWidth_px + kMargin_px;
  }
  std::vector<double> penetration;
  std::vector<double> tip;
  std::vector<double> node;
  for (const StepReport& step : run.steps) {
    penetration.push_back(step.max_penetration_mm);
    tip.push_back(step.tip_move_mm);
    node.push_back(step.max_move_mm);
  }
  int y = kPanelHeight_px + 2 * kMargin_px;
  const int plot_width = width - 2 * kMargin_px;
  for (const cv::Mat& figure :
       {plot(penetration, 0.2, "greatest wall penetration of each step; top of the scale 0.2 mm", plot_width),
        plot(tip, 10, "move of the tip; top of the scale 10 mm", plot_width),
        plot(node, 10, "greatest move of a node beyond following the catheter's path; top of the scale 10 mm",
             plot_width)}) {
    place(page, figure, kMargin_px, y);
    y += kPlotHeight_px + kMargin_px;
  }
  write_picture(file, page);
}

}  // namespace tubed
