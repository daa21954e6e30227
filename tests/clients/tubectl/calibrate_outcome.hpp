// What a verb below `tubectl calibrate` prints and ends with.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "clients/tubectl/verbs.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"

namespace tubed {

struct CalibrateOutcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// Runs `tubectl calibrate` with these words.
inline CalibrateOutcome calibrate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "calibrate");
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  CalibrateOutcome outcome;
  outcome.exit_code = run_verb(add_calibrate, std::move(arguments));
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

}  // namespace tubed
