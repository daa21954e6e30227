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
constexpr int kIndent_px = 20;  // of a row that goes on from the one above
constexpr int kSwatch_px = 30;
constexpr int kMinWidth_px = 1500;
constexpr double kLetters = 0.6;
const cv::Scalar kPaper(255, 255, 255);  // blue, green, red
const cv::Scalar kInk(30, 30, 30);
const cv::Scalar kPredicted(0, 200, 255);
const cv::Scalar kByCoilAndImage(80, 220, 60);
const cv::Scalar kByImage(230, 170, 0);
const cv::Scalar kByCoil(40, 140, 255);
const cv::Scalar kByNothing(70, 70, 255);
const cv::Scalar kMark(255, 60, 160);
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

const cv::Scalar& colour_of(std::uint32_t held_by) {
  const bool by_coil = (held_by & kHeldByCoil) != 0;
  const bool by_image = (held_by & kHeldByImage) != 0;
  if (by_coil && by_image) return kByCoilAndImage;
  if (by_image) return kByImage;
  return by_coil ? kByCoil : kByNothing;
}

/// Both edges, so that what lies between stays visible, in the colour of what holds each point; a ring at the
/// tip.
void draw_edges(Panel& panel, const ProjectedTube& tube) {
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
    for (std::size_t i = 0; i + 1 < count; ++i) {
      cv::line(panel.picture, edge[i], edge[i + 1], colour_of(tube.held_by[i]), 1, cv::LINE_AA);
    }
  }
  cv::circle(panel.picture, panel.at(tube.centreline_px.front()),
             static_cast<int>(std::lround(panel.scale * 5)), colour_of(tube.held_by.front()), 1, cv::LINE_AA);
}

/// Small squares, so that the dark band beneath stays visible.
void draw_marks(Panel& panel, const Explanation& explanation) {
  const int half = static_cast<int>(std::lround(panel.scale * 4));
  for (const Eigen::Vector2d& mark_px : explanation.marks_px) {
    const cv::Point at = panel.at(mark_px);
    cv::rectangle(panel.picture, {at.x - half, at.y - half, 2 * half, 2 * half}, kMark, 1, cv::LINE_AA);
  }
}

void draw_tubes(Panel& panel, const Explanation& explanation) {
  draw_dashed(panel, explanation.predicted, 6, kPredicted);
  draw_edges(panel, explanation.estimated);
  draw_marks(panel, explanation);
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

/// A piece of text as it is written: pieces that were one sentence, one below the other.
struct WrittenRow {
  std::string words;
  bool begins = true;  ///< else it goes on from the row above
};

int width_px(const std::string& words) {
  int baseline_px = 0;
  return cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, kLetters, 1, &baseline_px).width;
}

/// How many letters of `words` fit; at least one, and no word is cut that a row of its own could hold.
std::size_t fitting(const std::string& words, int column_px) {
  std::size_t fits = 1;
  while (fits < words.size() && width_px(words.substr(0, fits + 1)) <= column_px) ++fits;
  if (fits == words.size()) return fits;
  const std::size_t space = words.rfind(' ', fits);
  return space == std::string::npos || space == 0 ? fits : space;
}

/// In rows that are no wider than the column.
std::vector<WrittenRow> wrapped(const std::vector<std::string>& sentences, int column_px) {
  std::vector<WrittenRow> rows;
  for (const std::string& sentence : sentences) {
    std::string rest = sentence;
    for (bool begins = true; begins || !rest.empty(); begins = false) {
      const std::size_t count = fitting(rest, column_px - (begins ? 0 : kIndent_px));
      rows.push_back({rest.substr(0, count), begins});
      rest.erase(0, count);
      rest.erase(0, rest.find_first_not_of(' '));
    }
  }
  return rows;
}

void write(cv::Mat& page, const WrittenRow& row, cv::Point at) {
  at.x += row.begins ? 0 : kIndent_px;
  cv::putText(page, row.words, at, cv::FONT_HERSHEY_SIMPLEX, kLetters, kInk, 1, cv::LINE_AA);
}

struct LegendEntry {
  cv::Scalar colour;
  std::string meaning;
};

std::vector<LegendEntry> legend_of(const Explanation& explanation) {
  std::vector<LegendEntry> entries{
      {kPredicted, "dashed: predicted, from coils and what was known, without this image"},
      {kByCoilAndImage,
       "edges and ring at the tip: estimated, as published; this colour: held by a coil and the image"},
      {kByImage, "held by the image alone"},
      {kByCoil, "held by a coil alone"},
      {kByNothing, "held by neither: the tube's stiffness carries it"}};
  if (!explanation.marks_px.empty()) {
    entries.push_back({kMark, "squares: where the shape has the instrument's marks"});
  }
  if (explanation.truth) {
    entries.push_back({kTruth, "dotted: true centreline"});
  }
  entries.push_back({kReach, "lines across the predicted tube, as far as was looked"});
  entries.push_back({kAgrees, "found there, with one standard deviation: the image shows a ridge"});
  entries.push_back({kDisagrees, "no ridge there: carried by the neighbours, or lost"});
  return entries;
}

/// The words on the left half, the legend on the right one.
cv::Mat footer(const Explanation& explanation, int width) {
  const std::vector<LegendEntry> legend = legend_of(explanation);
  std::vector<std::string> meanings;
  for (const LegendEntry& entry : legend) meanings.push_back(entry.meaning);
  const int middle = width / 2;
  const std::vector<WrittenRow> words = wrapped(words_of(explanation), middle - 2 * kMargin_px);
  const std::vector<WrittenRow> meant = wrapped(meanings, width - middle - kSwatch_px - 2 * kMargin_px);
  const int rows = static_cast<int>(std::max(words.size(), meant.size()));
  cv::Mat page(rows * kRowHeight_px + kMargin_px, width, CV_8UC3, kPaper);
  int y = kRowHeight_px;
  for (const WrittenRow& row : words) {
    write(page, row, {kMargin_px, y});
    y += kRowHeight_px;
  }
  y = kRowHeight_px;
  auto entry = legend.begin();
  for (const WrittenRow& row : meant) {
    if (row.begins) cv::rectangle(page, {middle, y - 12, kSwatch_px, 12}, (entry++)->colour, cv::FILLED);
    write(page, row, {middle + kSwatch_px + kMargin_px, y});
    y += kRowHeight_px;
  }
  return page;
}

/// A title above each panel, no wider than it.
cv::Mat header(const std::vector<std::pair<std::string, Panel>>& panels, int width) {
  const int panel_px = panels.front().second.picture.cols;
  std::vector<std::vector<WrittenRow>> titles;
  std::size_t rows = 1;
  for (const auto& [title, panel] : panels) {
    titles.push_back(wrapped({title}, panel_px));
    rows = std::max(rows, titles.back().size());
  }
  cv::Mat page(static_cast<int>(rows) * kRowHeight_px, width, CV_8UC3, kPaper);
  int x = kMargin_px;
  for (const std::vector<WrittenRow>& title : titles) {
    int y = kRowHeight_px - 7;
    for (const WrittenRow& row : title) {
      write(page, row, {x, y});
      y += kRowHeight_px;
    }
    x += panel_px + kMargin_px;
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
  const cv::Mat above = header(panels, std::max(width, kMinWidth_px));
  const cv::Mat below = footer(explanation, above.cols);
  cv::Mat sheet(above.rows + size.height + kMargin_px + below.rows, above.cols, CV_8UC3, kPaper);
  above.copyTo(sheet(cv::Rect(0, 0, above.cols, above.rows)));
  int x = kMargin_px;
  for (const auto& [title, panel] : panels) {
    panel.picture.copyTo(sheet(cv::Rect(x, above.rows, size.width, size.height)));
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
