#include "clients/svg/svg.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

/// What stands between the paper and the end of a picture.
std::string shapes_of(const Svg& svg) {
  const std::string text = svg.str();
  const std::size_t paper = text.find("fill='white'/>\n");
  const std::size_t end = text.rfind("</svg>\n");
  return text.substr(paper + 15, end - paper - 15);
}

TEST(Svg, APictureBeginsWithItsSizeAndPaperAndEndsOnce) {
  const Svg svg(200, 100, "#0d1117");

  EXPECT_EQ(svg.str(),
            "<svg xmlns='http://www.w3.org/2000/svg' width='200' height='100' viewBox='0 0 200 100' "
            "font-family='sans-serif'>\n<rect width='100%' height='100%' fill='#0d1117'/>\n</svg>\n");
}

TEST(Svg, CoordinatesAreTenthsAndNeverMinusZero) {
  Svg svg(10, 10);
  svg.line({1.26, -0.01}, {123456.78, 2}, {"#555"});

  EXPECT_EQ(shapes_of(svg), "<line x1='1.3' y1='0' x2='123457' y2='2' stroke='#555' stroke-width='1'/>\n");
}

TEST(Svg, WordsAreNoMarkup) {
  Svg svg(10, 10);
  svg.text({1, 2}, "a < b & c > d", 11, TextAnchor::kMiddle);
  svg.text({1, 2}, {{"<x>", "red"}, {"y", "blue"}}, 15);

  EXPECT_EQ(
      shapes_of(svg),
      "<text x='1' y='2' font-size='11' text-anchor='middle' fill='#222'>a &lt; b &amp; c &gt; d</text>\n"
      "<text x='1' y='2' font-size='15'><tspan fill='red'>&lt;x&gt;</tspan>"
      "<tspan fill='blue' dx='16'>y</tspan></text>\n");
}

TEST(Svg, EachClipHasANameOfItsOwn) {
  Svg svg(10, 10);
  for (const double x : {1.0, 5.0}) {
    svg.begin_clip({x, 2}, 3, 4);
    svg.disc({x, 2}, 1, "red", 0.5);
    svg.end_clip();
  }

  EXPECT_EQ(shapes_of(svg),
            "<clipPath id='c1'><rect x='1' y='2' width='3' height='4'/></clipPath><g clip-path='url(#c1)'>\n"
            "<circle cx='1' cy='2' r='1' fill='red' fill-opacity='0.5'/>\n</g>\n"
            "<clipPath id='c2'><rect x='5' y='2' width='3' height='4'/></clipPath><g clip-path='url(#c2)'>\n"
            "<circle cx='5' cy='2' r='1' fill='red' fill-opacity='0.5'/>\n</g>\n");
}

TEST(Svg, LinesAreOpaqueUnlessTheySayHowMuch) {
  Svg svg(10, 10);
  svg.polyline({{1, 2}, {3, 4}}, {"red", 1.6, 0.8});
  svg.ring({1, 2}, 4, {"blue", 1.5});

  EXPECT_EQ(shapes_of(svg),
            "<polyline fill='none' stroke-linecap='round' stroke-linejoin='round' stroke='red' "
            "stroke-width='1.6' stroke-opacity='0.8' points='1,2 3,4 '/>\n"
            "<circle cx='1' cy='2' r='4' fill='none' stroke='blue' stroke-width='1.5'/>\n");
}

}  // namespace
}  // namespace tubed
