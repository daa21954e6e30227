#include "bench/accuracy/bench_experiment.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "bench/accuracy/bench_report.hpp"

namespace tubed {
namespace {

/// Frames and measurements at 0, 1, 2, ... 9 s; an image at 6 s.
Sequence sequence_of_ten() {
  Sequence sequence;
  for (std::uint32_t i = 0; i < 10; ++i) {
    SequenceFrame& frame = sequence.frames.emplace_back();
    frame.frame = i;
    frame.t_s = i;
    if (i == 6) frame.file = "6.png";
    sequence.measurements.emplace_back().t_s = i;
  }
  return sequence;
}

TEST(BenchExperiment, APositionHasWhatWasMeasuredInTheHaltUntilItsImage) {
  const Sequence still = during(sequence_of_ten(), {3.5, 8.5});
  ASSERT_EQ(still.frames.size(), 3U);
  EXPECT_EQ(still.frames.front().frame, 4U);
  EXPECT_EQ(still.frames.back().frame, 6U);
  EXPECT_EQ(still.measurements.size(), 3U);
  EXPECT_EQ(still.measurements.back().t_s, 6);
}

TEST(BenchExperiment, AHaltWithoutAnImageIsRefused) {
  EXPECT_THROW(during(sequence_of_ten(), {0, 5}), std::runtime_error);
}

MethodEvaluation evaluation_of(const std::vector<double>& rms_mm) {
  MethodEvaluation evaluation;
  for (const double rms : rms_mm) {
    ShapeError error;
    error.hausdorff_mm = 2 * rms;
    error.rms_mm = error.x_mm = error.y_mm = error.z_mm = rms;
    evaluation.errors.emplace_back(error);
  }
  return evaluation;
}

/// Two draws: fusing makes all five positions better in the first, four of five in the second.
std::vector<BenchDraw> two_draws() {
  BenchDraw first{1, {1, 2, 3}, {1, 1}, {2, 2}, {0.1, 0.1, 0.1, 0.1, 0.1}, {}};
  first.methods = {evaluation_of({1, 2, 3, 4, 5}), evaluation_of({0.5, 1.4, 2.3, 3.2, 4.1})};
  BenchDraw second = first;
  second.seed = 2;
  second.methods = {evaluation_of({3, 4, 5, 6, 7}), evaluation_of({3.05, 3.4, 4.3, 5.2, 6.1})};
  return {first, second};
}

TEST(BenchReport, ErrorsAreMediansOfPositionsOverTheDraws) {
  const std::vector<Method> methods = methods_of({"filter"}, {});
  ASSERT_EQ(methods.size(), 2U);
  for (const auto& row : bench_rows(two_draws(), methods)) {
    if (row["name"] != "accuracy/bench/filter-em/RMS") continue;
    EXPECT_EQ(row["values"], (std::vector<double>{3, 5}));
    EXPECT_EQ(row["p50"], 4);
    return;
  }
  FAIL() << "no row of the RMS";
}

TEST(BenchReport, FivePositionsHaveAnExactPOfASixteenthAtBest) {
  std::ostringstream text;
  print_bench(two_draws(), methods_of({"filter"}, {}), text);
  // 0.0625 times five metrics in the first draw; one of five worse by the least difference: 0.125 in the
  // second.
  EXPECT_NE(text.str().find("| `filter-em`, `filter` | RMS | "), std::string::npos) << text.str();
  EXPECT_NE(text.str().find("0.47 (0.31 to 0.62) | 1 of 2"), std::string::npos) << text.str();
  EXPECT_NE(text.str().find("| RMS | 4.00 (3.00 to 5.00) | 3.30 (2.30 to 4.30) | 4.7 | 3.7 |"),
            std::string::npos)
      << text.str();
}

}  // namespace
}  // namespace tubed
