#include "bench/geometry/sensitivity_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/laboratory/room_mistakes.hpp"

namespace tubed {
namespace {

/// `count` instants with that RMS and tip error, all in view.
MistakeRuns::Outcome outcome(std::size_t count, Validity validity, double rms_mm, double tip_mm) {
  MistakeRuns::Outcome outcome;
  for (std::size_t i = 0; i < count; ++i) {
    outcome.instants.push_back({static_cast<double>(i), true, validity, {}});
    ShapeError error;
    error.rms_mm = rms_mm;
    outcome.in_view.errors.emplace_back(error);
    outcome.tip_mm.push_back(tip_mm);
  }
  outcome.in_view.misleading[validity] = {count, validity == Validity::kValid ? count / 4 : count / 2};
  return outcome;
}

TEST(SensitivityTable, SaysHowMuchMoreTheErrorIsThanWithoutTheMistake) {
  PooledRuns without;
  without.add(outcome(8, Validity::kValid, 1.0, 2.0), {});
  PooledRuns with;
  with.add(outcome(8, Validity::kValid, 1.25, 2.5), {});
  with.add(outcome(4, Validity::kQuestionable, 3.5, 6.0), {});
  const std::string table = sensitivity_table({"registration=1,0", "none"}, {with, without});
  EXPECT_NE(table.find("| `registration=1,0` | 1.25 (1.25 to 3.50) | +0.25 | 2.50 | 66.7 | 25.0 | 33.3 |\n"),
            std::string::npos)
      << table;
  EXPECT_NE(table.find("| `none` | 1.00 (1.00 to 1.00) | +0.00 | 2.00 | 100.0 | 25.0 | 25.0 |\n"),
            std::string::npos)
      << table;
}

TEST(SensitivityTable, RunsThatShowNothingHaveNoErrors) {
  const std::string table = sensitivity_table({"none"}, {PooledRuns{}});
  EXPECT_NE(table.find("| `none` | - | - | - | 0.0 | 0.0 | 0.0 |\n"), std::string::npos) << table;
}

TEST(SensitivityTable, OperatorErrorsAreMistakesOfTheRoomOneAtATime) {
  const std::vector<std::string> errors = operator_errors();
  EXPECT_EQ(errors.front(), "none");
  for (std::size_t i = 1; i < errors.size(); ++i) {
    EXPECT_NO_THROW((void)parse_mistakes({errors[i]})) << errors[i];
    EXPECT_EQ(std::count(errors.begin(), errors.end(), errors[i]), 1) << errors[i];
  }
}

}  // namespace
}  // namespace tubed
