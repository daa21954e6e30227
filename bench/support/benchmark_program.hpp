// What every benchmark program does around its measurement: options, namespaces, JSON, pictures.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/support/report.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {

/// Where the measurement runs.
enum class Surroundings {
  kAsTheyAre,
  kOwnNetwork,  ///< enter_own_network(), in a child process
};

/// A benchmark as main() describes it.
struct BenchmarkProgram {
  std::string name;     ///< "publish": the default file is bench/results/publish.json
  std::string meaning;  ///< one sentence
  Surroundings surroundings = Surroundings::kOwnNetwork;
  std::function<void(CommandLine)> add_options;
  std::function<void(Report&)> measure;  ///< fills in the report; may throw
  /// Pictures of the JSON: suffix -> SVG. "" is bench/results/publish.svg, "series" publish-series.svg.
  std::function<std::map<std::string, std::string>(const nlohmann::json&)> draw;
};

/// Measures, prints the table, writes the JSON, then the pictures from that JSON. `--draw` draws those of an
/// existing JSON again without measuring. Returns main's exit code.
int run_benchmark(const BenchmarkProgram& program, int argc, char** argv);

}  // namespace tubed
