#include "clients/tubectl/see/explanation_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace tubed {

namespace {

constexpr double kPanelHeight_px = 960;
constexpr double kLinesScale = 4;
constexpr int kMargin_px = 12;
constexpr int kRowHeight_px = 26;
const cv::Scalar kPaper(255, 255, 255);  // blue, green, red
const cv::Scalar kInk(30, 30, 30);
const cv::Scalar kPredicted(0, 200, 255);
const cv::Scalar kEstimated(80, 220, 60);
const cv::Scalar kTruth(255, 120, 255);
const cv::Scalar kReach(190, 160, 90);
const cv::Scalar kAgrees(255, 230, 60);
const cv::Scalar kDisagrees(60, 60, 255);

/// A picture of the image at a scale, on which places of the image can be marked.
struct Panel {
  cv::Mat picture;
  double scale = 1;
  Eigen::Vector2d corner_px = Eigen::Vector2d::Zero();  ///< place of the image at the panel's corner

  [[nodiscard]] cv::Point at(const Eigen::Vector2d& p_px) const {
    const Eigen::Vector2d p = (p_px - corner_px) * scale;
    return {static_cast<int>(std::lround(std::clamp(p.x(), -1e4, 1e4))),
            static_cast<int>(std::lround(std::clamp(p.y(), -1e4, 1e4)))};
  }
};

/// Grey values from the 0.5th to the 99.5th percentile, so that a few bright pixels do not hide the rest.
cv::Mat stretched(const std::vector<float>& grey, int width, int height) {
  std::vector<float> sorted = grey;
  const auto percentile = [&](double share) {
    const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + k, sorted.end());
    return sorted[static_cast<std::size_t>(k)];
  };
  const float low = percentile(0.005);
  const float range = std::max(percentile(0.995) - low, 1e-6F);
  cv::Mat picture(height, width, CV_8U);
  for (std::size_t i = 0; i < grey.size(); ++i) {
    picture.data[i] = static_cast<unsigned char>(255 * std::clamp((grey[i] - low) / range, 0.0F, 1.0F));
  }
  cv::Mat coloured;
  cv::cvtColor(picture, coloured, cv::COLOR_GRAY2BGR);
  return coloured;
}

/// 0 .. `top` as colours from dark to bright.
cv::Mat heat(const std::vector<float>& values, float top, int width, int height) {
  cv::Mat picture(height, width, CV_8U);
  for (std::size_t i = 0; i < values.size(); ++i) {
    picture.data[i] = static_cast<unsigned char>(255 * std::clamp(values[i] / top, 0.0F, 1.0F));
  }
  cv::Mat coloured;
  cv::applyColorMap(picture, coloured, cv::COLORMAP_INFERNO);
  return coloured;
}

Panel enlarged(const cv::Mat& picture, double scale, int interpolation = cv::INTER_LINEAR) {
  Panel panel{{}, scale};
  cv::resize(picture, panel.picture, {}, scale, scale, interpolation);
  return panel;
}

/// Every second stretch of about `dash_px` of the image.
void draw_dashed(Panel& panel, const ProjectedTube& tube, double dash_px, const cv::Scalar& colour) {
  double along_px = 0;
  for (std::size_t i = 0; i + 1 < tube.centreline_px.size(); ++i) {
    const Eigen::Vector2d& a = tube.centreline_px[i];
    const Eigen::Vector2d& b = tube.centreline_px[i + 1];
    if (static_cast<int>(along_px / dash_px) % 2 == 0) {
      cv::line(panel.picture, panel.at(a), panel.at(b), colour, 1, cv::LINE_AA);
    }
    along_px += (b - a).norm();
  }
}

/// Both edges, so that what lies between stays visible; a ring at the tip.
void draw_edges(Panel& panel, const ProjectedTube& tube, const cv::Scalar& colour) {
  const std::size_t count = tube.centreline_px.size();
  if (count < 2) {
    return;
  }
  for (const double side : {-1.0, 1.0}) {
    std::vector<cv::Point> edge;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d along =
          (tube.centreline_px[std::min(i + 1, count - 1)] - tube.centreline_px[i > 0 ? i - 1 : 0])
              .normalized();
      edge.push_back(panel.at(tube.centreline_px[i] +
                              side * (tube.half_width_px[i] + 1) * Eigen::Vector2d(-along.y(), along.x())));
    }
    cv::polylines(panel.picture, edge, false, colour, 1, cv::LINE_AA);
  }
  cv::circle(panel.picture, panel.at(tube.centreline_px.front()),
             static_cast<int>(std::lround(panel.scale * 5)), colour, 1, cv::LINE_AA);
}

void draw_tubes(Panel& panel, const Explanation& explanation) {
  draw_dashed(panel, explanation.predicted, 6, kPredicted);
  draw_edges(panel, explanation.estimated, kEstimated);
  if (explanation.truth) {
    draw_dashed(panel, *explanation.truth, 1.5, kTruth);
  }
}

/// Each line over its reach; on it mean and one standard deviation of what was found.
void draw_lines(Panel& panel, const Explanation& explanation) {
  for (int i = 0; i < explanation.layout.count; ++i) {
    const CorrespondenceLine& line = explanation.lines[static_cast<std::size_t>(i)];
    if (!line.in_view) {
      continue;
    }
    const auto place = [&](double offset_px) { return panel.at(line.base_px + offset_px * line.normal); };
    cv::line(panel.picture, place(-explanation.reach_px), place(explanation.reach_px), kReach, 1,
             cv::LINE_AA);
  }
  for (int i = 0; i < explanation.layout.count; ++i) {
    const CorrespondenceLine& line = explanation.lines[static_cast<std::size_t>(i)];
    if (!line.in_view) {
      continue;
    }
    const cv::Scalar& colour = line.agrees ? kAgrees : kDisagrees;
    const double sigma_px = std::sqrt(line.variance_px2);
    const auto place = [&](double offset_px) { return panel.at(line.base_px + offset_px * line.normal); };
    cv::line(panel.picture, place(line.offset_px - sigma_px), place(line.offset_px + sigma_px), colour, 1,
             cv::LINE_AA);
    cv::circle(panel.picture, place(line.offset_px), 2, colour, cv::FILLED, cv::LINE_AA);
  }
}

void write(cv::Mat& page, const std::string& words, cv::Point at, double size = 0.6) {
  cv::putText(page, words, at, cv::FONT_HERSHEY_SIMPLEX, size, kInk, 1, cv::LINE_AA);
}

struct LegendEntry {
  cv::Scalar colour;
  const char* meaning;
};

std::vector<LegendEntry> legend_of(const Explanation& explanation) {
  std::vector<LegendEntry> entries{
      {kPredicted, "dashed: predicted, from coils and what was known, without this image"},
      {kEstimated, "edges and ring at the tip: estimated, as published"}};
  if (explanation.truth) {
    entries.push_back({kTruth, "dotted: true centreline"});
  }
  entries.push_back({kReach, "lines across the predicted tube, as far as was looked"});
  entries.push_back({kAgrees, "found there, with one standard deviation: the image shows a ridge"});
  entries.push_back({kDisagrees, "no ridge there: carried by the neighbours, or lost"});
  return entries;
}

cv::Mat footer(const Explanation& explanation, int width) {
  const std::vector<std::string> words = words_of(explanation);
  const std::vector<LegendEntry> legend = legend_of(explanation);
  const int rows = static_cast<int>(std::max(words.size(), legend.size()));
  cv::Mat page(rows * kRowHeight_px + kMargin_px, width, CV_8UC3, kPaper);
  int y = kRowHeight_px;
  for (const std::string& line : words) {
    write(page, line, {kMargin_px, y});
    y += kRowHeight_px;
  }
  y = kRowHeight_px;
  for (const LegendEntry& entry : legend) {
    cv::rectangle(page, {width / 2, y - 12, 30, 12}, entry.colour, cv::FILLED);
    write(page, entry.meaning, {width / 2 + 42, y});
    y += kRowHeight_px;
  }
  return page;
}

std::vector<std::pair<std::string, Panel>> panels_of(const Explanation& explanation) {
  const ImageMeasurement& image = explanation.image;
  const double scale = std::clamp(kPanelHeight_px / explanation.camera.height, 0.4, 4.0);
  const bool measured = image.state == ImageState::kMeasured;
  const cv::Mat nothing(explanation.camera.height, explanation.camera.width, CV_8UC3, cv::Scalar::all(90));
  const cv::Mat grey = measured ? stretched(image.grey, image.width, image.height) : nothing;
  std::vector<std::pair<std::string, Panel>> panels;
  panels.emplace_back("image", enlarged(grey, scale));
  draw_tubes(panels.back().second, explanation);
  const float top = std::max(2 * explanation.found.ridge_height, 0.05F);
  std::array<char, 64> title{};
  std::snprintf(title.data(), title.size(), "vesselness, 0 to %.2f", static_cast<double>(top));
  panels.emplace_back(
      title.data(),
      enlarged(measured ? heat(image.vesselness, top, image.width, image.height) : nothing, scale));
  panels.emplace_back(
      "P(tube | grey value, vesselness), 0 to 1",
      enlarged(
          explanation.posterior.empty() ? nothing : heat(explanation.posterior, 1, image.width, image.height),
          scale));
  panels.emplace_back("lines and what they found", enlarged(grey, scale));
  draw_lines(panels.back().second, explanation);
  return panels;
}

}  // namespace

cv::Mat draw_sheet(const Explanation& explanation) {
  const auto panels = panels_of(explanation);
  const cv::Size size = panels.front().second.picture.size();
  const int width = static_cast<int>(panels.size()) * (size.width + kMargin_px) + kMargin_px;
  const cv::Mat below = footer(explanation, std::max(width, 1500));
  cv::Mat sheet(kRowHeight_px + size.height + kMargin_px + below.rows, below.cols, CV_8UC3, kPaper);
  int x = kMargin_px;
  for (const auto& [title, panel] : panels) {
    write(sheet, title, {x, kRowHeight_px - 7});
    panel.picture.copyTo(sheet(cv::Rect(x, kRowHeight_px, size.width, size.height)));
    x += size.width + kMargin_px;
  }
  below.copyTo(sheet(cv::Rect(0, sheet.rows - below.rows, below.cols, below.rows)));
  return sheet;
}

cv::Mat draw_lines(const Explanation& explanation) {
  Eigen::AlignedBox2d around;
  for (int i = 0; i < explanation.layout.count; ++i) {
    const CorrespondenceLine& line = explanation.lines[static_cast<std::size_t>(i)];
    if (line.in_view) {
      around.extend(line.base_px);
    }
  }
  const ImageMeasurement& image = explanation.image;
  if (around.isEmpty() || image.state != ImageState::kMeasured) {
    return {};
  }
  const double beyond_px = explanation.reach_px + 5.0;
  const int left = std::max(0, static_cast<int>(around.min().x() - beyond_px));
  const int top = std::max(0, static_cast<int>(around.min().y() - beyond_px));
  const int right = std::min(image.width, static_cast<int>(around.max().x() + beyond_px) + 1);
  const int bottom = std::min(image.height, static_cast<int>(around.max().y() + beyond_px) + 1);
  const cv::Mat part =
      stretched(image.grey, image.width, image.height)(cv::Rect(left, top, right - left, bottom - top));
  // Pixels are drawn as squares around their centres.
  Panel panel = enlarged(part, kLinesScale, cv::INTER_NEAREST);
  panel.corner_px = {left - 0.5, top - 0.5};
  draw_lines(panel, explanation);
  draw_tubes(panel, explanation);
  return panel.picture;
}

}  // namespace tubed
