// stages_bench [--turns N] [--only TEXT] [--json FILE]: what the pipeline's stages cost on one core, beside
// peers.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "bench/stages/stages.hpp"

int main(int argc, char** argv) {
  CLI::App app("What the pipeline's stages cost on one core, beside peers in the same process, by turns.");
  tubed::StageChoice choice;
  std::string json;
  app.add_option("--turns", choice.turns, "turns of each side of a comparison")->check(CLI::Range(2, 100000));
  app.add_option("--only", choice.only, "only rows whose names contain this");
  app.add_option("--json", json, "also write the figures to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    tubed::Report report;
    tubed::measure_frangi(choice, report);
    tubed::measure_solve(choice, report);
    std::fputs(report.table().c_str(), stdout);
    if (!json.empty()) {
      tubed::write_text(json, report.json());
    }
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "stages_bench: %s\n", problem.what());
    return 1;
  }
  return 0;
}
