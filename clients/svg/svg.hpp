// SVG as the pictures of this project need it. Coordinates in px, y down; written in tenths.
#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace tubed {

struct SvgPoint {
  double x = 0;
  double y = 0;
};

/// A line of this colour; opacity from 0, invisible, to 1.
struct SvgStroke {
  std::string colour;
  double width = 1;
  double opacity = 1;
};

enum class TextAnchor { kStart, kMiddle, kEnd };

/// Words of one colour within a line of text.
struct ColouredWords {
  std::string words;
  std::string colour;
};

/// Collects shapes; each lies on those before it. str() is the whole picture.
class Svg {
 public:
  Svg(double width, double height, const std::string& paper = "white");

  void line(SvgPoint from, SvgPoint to, const SvgStroke& stroke);
  void rectangle(SvgPoint corner, double width, double height, const std::string& stroke,
                 const std::string& fill);
  /// Round at its ends and corners.
  void polyline(const std::vector<SvgPoint>& points, const SvgStroke& stroke);
  void ring(SvgPoint centre, double radius, const SvgStroke& stroke);
  void disc(SvgPoint centre, double radius, const std::string& fill, double opacity = 1);
  void text(SvgPoint at, const std::string& words, double size, TextAnchor anchor,
            const std::string& colour = "#222");
  /// One line of text; some space between its parts.
  void text(SvgPoint at, const std::vector<ColouredWords>& parts, double size);

  /// What follows is shown inside of a rectangle only, until end_clip(). Not nested.
  void begin_clip(SvgPoint corner, double width, double height);
  void end_clip();

  [[nodiscard]] std::string str() const;

 private:
  std::ostringstream body_;
  int clips_ = 0;
};

}  // namespace tubed
