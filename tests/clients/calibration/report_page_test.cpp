#include "clients/calibration/report_page.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ReportPage, SaysWhatItIsAboutAndWhatItIsNot) {
  const std::string page = ReportPage("Registration", "13 markers").str();

  EXPECT_NE(page.find("Registration"), std::string::npos);
  EXPECT_NE(page.find("13 markers"), std::string::npos);
  EXPECT_NE(page.find("not a medical device"), std::string::npos);
}

TEST(ReportPage, LongSentencesAreBrokenBetweenWords) {
  ReportPage page("t", "s");
  const std::size_t before = count_of(page.str(), "<text");
  std::string words;
  for (int i = 0; i < 40; ++i) words += "marker ";

  page.text(words);

  EXPECT_EQ(count_of(page.str(), "<text"), before + 3);  // 279 characters, 99 a line
  EXPECT_EQ(count_of(page.str(), "marker"), 40U);
}

TEST(ReportPage, NumbersStandToTheRightAndMarkedRowsAreRed) {
  ReportPage page("t", "s");
  page.table({"marker", "residual, mm"}, {{"nose", "1.8"}, {"ear", "8.1"}}, {1});

  const std::string text = page.str();
  EXPECT_NE(text.find("text-anchor='end' fill='#222'>1.8<"), std::string::npos) << text;
  EXPECT_NE(text.find("text-anchor='end' fill='#b3261e'>8.1<"), std::string::npos);
  EXPECT_NE(text.find("fill='#b3261e'>ear<"), std::string::npos);
}

TEST(ReportPage, AFullPageSaysThatThereIsMore) {
  ReportPage page("t", "s");
  for (int i = 0; i < 100; ++i) page.verdict(ReportVerdict::kBad, "row " + std::to_string(i));

  EXPECT_EQ(count_of(page.str(), "There is more than fits"), 1U);
  EXPECT_EQ(page.str().find("row 99<"), std::string::npos);
}

TEST(ReportFigures, ABarIsAsLongAsItsValueAndRedBeyondTheLimit) {
  Svg svg(800, 100);
  draw_bars(svg, {{0, 0}, 414 + 100 - 20, 40}, {{"a", 1}, {"b", 4}}, "mm", 2);

  // The label takes 14 + 6.5 px, the value 80: 393.5 px are 4 mm.
  const std::string text = svg.str();
  EXPECT_NE(text.find("width='98.4' height='16' stroke='none' fill='#2b6cb0'"), std::string::npos) << text;
  EXPECT_NE(text.find("width='393.5' height='16' stroke='none' fill='#b3261e'"), std::string::npos);
  EXPECT_NE(text.find(">4 mm<"), std::string::npos);
}

TEST(ReportFigures, PointsStandWhereTheTicksSay) {
  Svg svg(500, 300);
  draw_plot(svg, {{0, 0}, 468, 262}, {"x, mm", "y, mm"}, {{"", "red", {{0, 0}, {10, 100}, {5, 50}}}});

  // The axes' area is 56..456 by 22..222; 0..10 and 0..100 are round already.
  const std::string text = svg.str();
  EXPECT_NE(text.find("<circle cx='56' cy='222'"), std::string::npos) << text;
  EXPECT_NE(text.find("<circle cx='456' cy='22'"), std::string::npos);
  EXPECT_NE(text.find("<circle cx='256' cy='122'"), std::string::npos);
}

TEST(ReportFigures, NothingToPlotAndNumbersThatAreNoneAreDrawnAsNothing) {
  Svg svg(500, 300);
  draw_plot(svg, {{0, 0}, 468, 262}, {"x", "y"}, {{"", "red", {{NAN, 1}}}});
  draw_plot(svg, {{0, 0}, 468, 262}, {"x", "y"}, {{"", "red", {{3, 3}}}});

  EXPECT_EQ(count_of(svg.str(), "<circle"), 1U);
  EXPECT_EQ(svg.str().find("nan"), std::string::npos);
}

}  // namespace
}  // namespace tubed
