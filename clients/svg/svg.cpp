#include "clients/svg/svg.hpp"

#include <array>
#include <cmath>

namespace tubed {

namespace {

/// Tenths of a px are finer than anyone sees; and never "-0".
double tenths(double value) { return std::round(value * 10) / 10 + 0.0; }

std::string escaped(const std::string& words) {
  std::string text;
  for (const char c : words) {
    text += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return text;
}

struct Place {  // as the attributes x and y
  SvgPoint at;
};
std::ostream& operator<<(std::ostream& out, const Place& place) {
  return out << "x='" << tenths(place.at.x) << "' y='" << tenths(place.at.y) << '\'';
}

std::ostream& operator<<(std::ostream& out, const SvgStroke& stroke) {
  out << " stroke='" << stroke.colour << "' stroke-width='" << tenths(stroke.width) << '\'';
  return stroke.opacity < 1 ? out << " stroke-opacity='" << stroke.opacity << '\'' : out;
}

}  // namespace

Svg::Svg(double width, double height, const std::string& paper) {
  body_ << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width << "' height='" << height
        << "' viewBox='0 0 " << width << ' ' << height << "' font-family='sans-serif'>\n"
        << "<rect width='100%' height='100%' fill='" << paper << "'/>\n";
}

void Svg::line(SvgPoint from, SvgPoint to, const SvgStroke& stroke) {
  body_ << "<line x1='" << tenths(from.x) << "' y1='" << tenths(from.y) << "' x2='" << tenths(to.x)
        << "' y2='" << tenths(to.y) << '\'' << stroke << "/>\n";
}

void Svg::rectangle(SvgPoint corner, double width, double height, const std::string& stroke,
                    const std::string& fill) {
  body_ << "<rect " << Place{corner} << " width='" << tenths(width) << "' height='" << tenths(height)
        << "' stroke='" << stroke << "' fill='" << fill << "'/>\n";
}

void Svg::polyline(const std::vector<SvgPoint>& points, const SvgStroke& stroke) {
  body_ << "<polyline fill='none' stroke-linecap='round' stroke-linejoin='round'" << stroke << " points='";
  for (const SvgPoint& point : points) body_ << tenths(point.x) << ',' << tenths(point.y) << ' ';
  body_ << "'/>\n";
}

void Svg::ring(SvgPoint centre, double radius, const SvgStroke& stroke) {
  body_ << "<circle cx='" << tenths(centre.x) << "' cy='" << tenths(centre.y) << "' r='" << tenths(radius)
        << "' fill='none'" << stroke << "/>\n";
}

void Svg::disc(SvgPoint centre, double radius, const std::string& fill, double opacity) {
  body_ << "<circle cx='" << tenths(centre.x) << "' cy='" << tenths(centre.y) << "' r='" << tenths(radius)
        << "' fill='" << fill << "' fill-opacity='" << opacity << "'/>\n";
}

void Svg::text(SvgPoint at, const std::string& words, double size, TextAnchor anchor,
               const std::string& colour) {
  constexpr std::array<const char*, 3> kAnchors{"start", "middle", "end"};
  body_ << "<text " << Place{at} << " font-size='" << size << "' text-anchor='"
        << kAnchors[static_cast<std::size_t>(anchor)] << "' fill='" << colour << "'>" << escaped(words)
        << "</text>\n";
}

void Svg::text(SvgPoint at, const std::vector<ColouredWords>& parts, double size) {
  body_ << "<text " << Place{at} << " font-size='" << size << "'>";
  const char* space = "";
  for (const ColouredWords& part : parts) {
    body_ << "<tspan fill='" << part.colour << '\'' << space << '>' << escaped(part.words) << "</tspan>";
    space = " dx='16'";
  }
  body_ << "</text>\n";
}

void Svg::begin_clip(SvgPoint corner, double width, double height) {
  ++clips_;
  body_ << "<clipPath id='c" << clips_ << "'><rect " << Place{corner} << " width='" << tenths(width)
        << "' height='" << tenths(height) << "'/></clipPath><g clip-path='url(#c" << clips_ << ")'>\n";
}

void Svg::end_clip() { body_ << "</g>\n"; }

std::string Svg::str() const { return body_.str() + "</svg>\n"; }

}  // namespace tubed
