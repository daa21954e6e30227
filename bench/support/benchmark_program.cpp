#include "bench/support/benchmark_program.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "bench/support/child_process.hpp"
#include "bench/support/machine.hpp"
#include "bench/support/own_network.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

std::string measured(const BenchmarkProgram& program, const std::string& command) {
  Report report;
  report.set_command(command);
  program.measure(report);
  std::fputs(report.table().c_str(), stdout);
  std::fflush(stdout);
  return report.json();
}

void write_all(int descriptor, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = write(descriptor, text.data() + done, text.size() - done);
    if (count <= 0) throw std::runtime_error("the figures could not be handed over");
    done += static_cast<std::size_t>(count);
  }
}

/// In a child, whose mounts and network are not ours; the JSON comes back through a pipe.
std::string measured_apart(const BenchmarkProgram& program, const std::string& command) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  ChildProcess child([&] {
    close(ends[0]);
    enter_own_network();
    write_all(ends[1], measured(program, command));
  });
  close(ends[1]);
  std::string json;
  std::array<char, 65536> part{};
  for (ssize_t count = 0; (count = read(ends[0], part.data(), part.size())) > 0;) {
    json.append(part.data(), static_cast<std::size_t>(count));
  }
  close(ends[0]);
  if (child.wait() != 0 || json.empty()) throw std::runtime_error("nothing was measured");
  return json;
}

void draw(const BenchmarkProgram& program, const fs::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  for (const auto& [suffix, picture] : program.draw(nlohmann::json::parse(stream))) {
    fs::path path = file;
    path.replace_extension();
    path += (suffix.empty() ? "" : "-" + suffix) + ".svg";
    write_text(path.string(), picture);
    std::printf("drew %s\n", path.c_str());
  }
}

}  // namespace

int run_benchmark(const BenchmarkProgram& program, int argc, char** argv) {
  Program parsed(program.meaning);
  CommandLine app = parsed.command_line();
  std::string file = TUBED_SOURCE_DIR "/bench/results/" + program.name + ".json";
  bool draw_only = false;
  app.add_option("--json", file, "where the figures go; pictures beside it").capture_default_str();
  app.add_flag("--draw", draw_only, "draw the pictures of --json again, measure nothing");
  program.add_options(app);
  if (const auto ended = parsed.parse(argc, argv)) return *ended;
  try {
    if (!draw_only) {
      const std::string command = command_line(program.name, argc, argv);
      const bool apart = program.surroundings == Surroundings::kOwnNetwork;
      write_text(file, apart ? measured_apart(program, command) : measured(program, command));
      std::printf("wrote %s\n", file.c_str());
    }
    draw(program, file);
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s_bench: %s\n", program.name.c_str(), problem.what());
    return 1;
  }
  return 0;
}

}  // namespace tubed
