#include "bench/support/report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "bench/support/latency_plots.hpp"

namespace tubed {
namespace {

/// n values around `first`, then n around `second`.
std::vector<double> two_halves(double first, double second, std::size_t n = 10) {
  std::vector<double> values(2 * n, first);
  std::fill(values.begin() + static_cast<std::ptrdiff_t>(n), values.end(), second);
  return values;
}

nlohmann::json only_row_of(const Report& report) {
  const auto json = nlohmann::json::parse(report.json());
  return json.at("rows").at(0);
}

TEST(Report, HalvesThatDifferByMoreThan15PercentAreFlagged) {
  EXPECT_TRUE(is_unsteady(two_halves(1, 1.16)));
  EXPECT_TRUE(is_unsteady(two_halves(1.16, 1)));
  EXPECT_FALSE(is_unsteady(two_halves(1, 1.14)));
}

TEST(Report, AFlaggedRowSaysSoInJsonAndTable) {
  Report report;
  report.add({"a", "ms", two_halves(1, 2), "", {}, {}, {}});

  EXPECT_TRUE(only_row_of(report).at("flagged"));
  EXPECT_NE(report.table().find("UNSTEADY"), std::string::npos);
}

TEST(Report, TheHistogramHoldsEveryValueOnce) {
  std::vector<double> values(1000);
  std::iota(values.begin(), values.end(), 1);
  Report report;
  report.add({"a", "us", values, "", {}, {}, {}});

  const nlohmann::json row = only_row_of(report);
  double count = 0;
  for (const auto& bin : row.at("histogram")) count += bin[2].get<double>();

  EXPECT_EQ(count, 1000);
  EXPECT_NEAR(row.at("p50"), 500.5, 1e-9);
}

TEST(Report, ThePercentileCurveRisesAndEndsAtTheGreatest) {
  std::vector<double> values(1000);
  std::iota(values.rbegin(), values.rend(), 1);
  Report report;
  report.add({"a", "us", values, "", {}, {}, {}});

  const nlohmann::json curve = only_row_of(report).at("curve");

  for (std::size_t i = 1; i < curve.size(); ++i) {
    EXPECT_GT(curve[i][0], curve[i - 1][0]);
    EXPECT_GE(curve[i][1], curve[i - 1][1]);
  }
  EXPECT_EQ(curve.back()[1], 1000);
}

TEST(Report, ASeriesHasMedianAndGreatestOfEachStretch) {
  ReportRow row{"a", "ms", std::vector<double>(900, 1), "", {}, {}, {}};
  row.values[450] = 7;
  for (int i = 0; i < 900; ++i) row.t_s.push_back(i);
  Report report;
  report.add(row);

  const nlohmann::json series = only_row_of(report).at("series");

  double greatest = 0;
  for (const auto& point : series) {
    EXPECT_EQ(point[1], 1);
    greatest = std::max(greatest, point[2].get<double>());
  }
  EXPECT_LE(series.size(), 150U);
  EXPECT_EQ(greatest, 7);
}

TEST(Report, ARowWithoutValuesIsRefused) {
  Report report;
  EXPECT_THROW(report.add({"a", "ms", {}, "", {}, {}, {}}), std::invalid_argument);
  EXPECT_THROW(report.add({"a", "ms", {1, 2}, "", {}, {}, {0}}), std::invalid_argument);
}

TEST(LatencyPlots, EveryRowHasItsCurveAndItsNameInTheLegend) {
  Report report;
  report.add({"x/one", "us", two_halves(1, 2, 50), "", {}, {}, {}});
  report.add({"x/two", "us", two_halves(3, 4, 50), "", {}, {}, {}});
  const auto json = nlohmann::json::parse(report.json());

  const std::string picture = percentile_plots("title", {panel_of("panel", json, "x/")});

  std::size_t curves = 0;
  for (std::size_t at = picture.find("<polyline"); at != std::string::npos;
       at = picture.find("<polyline", at + 1)) {
    ++curves;
  }
  EXPECT_EQ(curves, 2U);
  EXPECT_NE(picture.find(">one<"), std::string::npos);
  EXPECT_NE(picture.find(">two<"), std::string::npos);
}

}  // namespace
}  // namespace tubed
