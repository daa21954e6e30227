// One page about one calibration, as SVG of the size of A4: a verdict, figures, tables, remarks.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/svg/svg.hpp"

namespace tubed {

/// How a statement of a report is meant.
enum class ReportVerdict { kGood, kDoubtful, kBad };

/// Collects the page from top to bottom; what no longer fits is cut and the page says so. Of one thread.
class ReportPage {
 public:
  /// "Registration of the EM tracker", "13 markers, 2026-11-24 14:05".
  ReportPage(const std::string& title, const std::string& subtitle);

  void heading(const std::string& words);
  /// A paragraph; broken into lines where it is too long.
  void text(const std::string& words);
  /// A sentence with a mark before it: a green tick, an amber exclamation mark, a red cross.
  void verdict(ReportVerdict verdict, const std::string& words);
  /// Columns are as wide as their longest cell asks for; numbers (cells that begin with a digit or a sign)
  /// stand to the right. Every row has as many cells as `header`. Rows of `marked` are drawn red.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows,
             const std::vector<std::size_t>& marked = {});

  /// Room for a drawing of that height over the whole width, with a caption below it. `draw` gets the picture
  /// and the corner, width and height of the room, px; what it draws beyond is cut off.
  struct Room {
    SvgPoint corner;
    double width;
    double height;
  };
  void figure(double height_px, const std::string& caption,
              const std::function<void(Svg&, const Room&)>& draw);

  [[nodiscard]] std::string str() const;

 private:
  [[nodiscard]] bool fits(double height_px);

  Svg svg_;
  double y_ = 0;
  bool is_full_ = false;
};

/// A figure of bars, one a row, labels on the left and values on the right; a line at `limit` when it is > 0.
/// Bars beyond it are red. The unit stands at the end of each value.
struct Bar {
  std::string label;
  double value = 0;
};
void draw_bars(Svg& svg, const ReportPage::Room& room, const std::vector<Bar>& bars, const std::string& unit,
               double limit = 0);

/// A figure of points over an axis each, with ticks and names of the axes; `line` is drawn through its
/// points.
struct PlotSeries {
  std::string name;
  std::string colour;
  std::vector<SvgPoint> points;  ///< in the axes' units
  bool line = false;
};
struct PlotAxes {
  std::string x;  ///< name with unit
  std::string y;
};
void draw_plot(Svg& svg, const ReportPage::Room& room, const PlotAxes& axes,
               const std::vector<PlotSeries>& series);

}  // namespace tubed
