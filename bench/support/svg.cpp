#include "bench/support/svg.hpp"

#include <cmath>
#include <cstdio>

namespace tubed {

namespace {

std::string escaped(const std::string& words) {
  std::string text;
  for (const char c : words) {
    text += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return text;
}

/// 1, 2 or 5 times a power of ten: about five steps up to `top`.
double round_step(double top) {
  const double power = std::pow(10, std::floor(std::log10(top / 5)));
  const double digits = top / 5 / power;
  return power * (digits <= 1 ? 1 : digits <= 2 ? 2 : digits <= 5 ? 5 : 10);
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

void Svg::line(PlotPoint from, PlotPoint to, const std::string& colour, double stroke) {
  body_ << "<line x1='" << from.x << "' y1='" << from.y << "' x2='" << to.x << "' y2='" << to.y
        << "' stroke='" << colour << "' stroke-width='" << stroke << "'/>\n";
}

void Svg::rectangle(PlotPoint corner, double width, double height, const std::string& stroke,
                    const std::string& fill) {
  body_ << "<rect x='" << corner.x << "' y='" << corner.y << "' width='" << width << "' height='" << height
        << "' stroke='" << stroke << "' fill='" << fill << "'/>\n";
}

void Svg::polyline(const std::vector<PlotPoint>& points, const std::string& colour, double stroke) {
  body_ << "<polyline fill='none' stroke='" << colour << "' stroke-width='" << stroke << "' points='";
  for (const PlotPoint& point : points) body_ << point.x << ',' << point.y << ' ';
  body_ << "'/>\n";
}

void Svg::text(PlotPoint at, const std::string& words, double size, TextAnchor anchor,
               const std::string& colour) {
  constexpr const char* kAnchors[] = {"start", "middle", "end"};
  body_ << "<text x='" << at.x << "' y='" << at.y << "' font-size='" << size << "' text-anchor='"
        << kAnchors[static_cast<int>(anchor)] << "' fill='" << colour << "'>" << escaped(words)
        << "</text>\n";
}

std::string Svg::str() const {
  std::ostringstream picture;
  picture << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width_ << "' height='" << height_
          << "' viewBox='0 0 " << width_ << ' ' << height_ << "' font-family='sans-serif'>\n"
          << "<rect width='100%' height='100%' fill='white'/>\n"
          << body_.str() << "</svg>\n";
  return picture.str();
}

void ValueAxis::draw(Svg& svg, const std::string& label) const {
  const double step = round_step(top);
  for (double value = 0; value <= top * 1.0001; value += step) {
    svg.line({left, y(value)}, {right, y(value)}, value == 0 ? "#555" : "#ddd");
    svg.text({left - 6, y(value) + 4}, short_number(value), 11, TextAnchor::kEnd);
  }
  svg.text({left - 6, bottom - height - 10}, label, 11, TextAnchor::kStart);
}

}  // namespace tubed
