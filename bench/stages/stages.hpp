// The stages of the pipeline, each measured beside a peer by turns. A new stage is a function here and in
// main.cpp's list.
#pragma once

#include <string>

#include "bench/support/report.hpp"

namespace tubed {

/// What the person asked for.
struct StageChoice {
  int turns = 60;    ///< of each side of every comparison
  std::string only;  ///< measure only rows whose names contain this

  [[nodiscard]] bool wants(const std::string& name) const { return name.find(only) != std::string::npos; }
};

/// frangi/<w>x<h>/<n>scales/<full|band>[/variant]
void measure_frangi(const StageChoice& choice, Report& report);

/// likelihood/<w>x<h>/lines, solve/<coefficients>/<what>, instant/<mode>
void measure_solve(const StageChoice& choice, Report& report);

}  // namespace tubed
