// Just enough of SVG for the plots of this bench. Coordinates in px, y down.
#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace tubed {

struct PlotPoint {
  double x = 0;
  double y = 0;
};

enum class TextAnchor { kStart, kMiddle, kEnd };

/// Collects shapes; str() is the whole picture on white.
class Svg {
 public:
  Svg(double width, double height) : width_(width), height_(height) {}
  void line(PlotPoint from, PlotPoint to, const std::string& colour, double stroke = 1);
  void rectangle(PlotPoint corner, double width, double height, const std::string& stroke,
                 const std::string& fill);
  void polyline(const std::vector<PlotPoint>& points, const std::string& colour, double stroke = 1.2);
  void text(PlotPoint at, const std::string& words, double size, TextAnchor anchor,
            const std::string& colour = "#222");
  [[nodiscard]] std::string str() const;

 private:
  double width_;
  double height_;
  std::ostringstream body_;
};

/// A vertical axis from 0 to `top` on `height` px, for values in `unit`.
struct ValueAxis {
  double left = 0;    ///< px of the axis
  double right = 0;   ///< to where grid lines go
  double bottom = 0;  ///< px of 0
  double height = 0;
  double top = 1;  ///< value at the upper end
  [[nodiscard]] double y(double value) const { return bottom - height * value / top; }
  /// Grid lines with numbers at a round step, and the label above.
  void draw(Svg& svg, const std::string& label) const;
};

}  // namespace tubed
