// stages_bench: what the pipeline's stages cost on one core, beside peers.
#include "bench/stages/stages.hpp"
#include "bench/support/benchmark_program.hpp"

int main(int argc, char** argv) {
  tubed::StageChoice choice;
  return tubed::run_benchmark(
      {"stages", "What the pipeline's stages cost on one core, beside peers in the same process, by turns.",
       tubed::Surroundings::kAsTheyAre,
       [&](tubed::CommandLine app) {
         app.add_option("--turns", choice.turns, "turns of each side of a comparison").in_range(2, 100000);
         app.add_option("--only", choice.only, "only rows whose names contain this");
       },
       [&](tubed::Report& report) {
         tubed::measure_frangi(choice, report);
         tubed::measure_solve(choice, report);
       },
       [](const nlohmann::json&) { return std::map<std::string, std::string>{}; }},
      argc, argv);
}
