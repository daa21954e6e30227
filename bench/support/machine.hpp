// What a figure was measured on.
#pragma once

#include <string>

namespace tubed {

/// The machine at this moment, as Linux tells it. What cannot be read is empty or 0.
struct Machine {
  std::string cpu;     ///< model name of /proc/cpuinfo
  int cores = 0;       ///< this process may use
  std::string kernel;  ///< release
  std::string flags;   ///< of the instruction sets that matter here: "avx2 fma avx512f"
  double load = 0;     ///< load average of the last minute
};

Machine this_machine();

/// `git describe` of the source tree, "-dirty" at its end when files differ; "unknown" without git.
std::string source_revision();

/// What was typed to run benchmark `name` with these arguments of main().
std::string command_line(const std::string& name, int argc, char** argv);

}  // namespace tubed
