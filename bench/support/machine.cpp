#include "bench/support/machine.hpp"

#include <sched.h>
#include <sys/utsname.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>

namespace tubed {

namespace {

// The value of the first line of /proc/cpuinfo that begins with `key`.
std::string cpu_property(const std::string& key) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(':');
    if (line.starts_with(key) && colon != std::string::npos && colon + 2 <= line.size()) {
      return line.substr(colon + 2);
    }
  }
  return {};
}

std::string flags_that_matter() {
  std::istringstream all(cpu_property("flags"));
  std::string kept;
  for (std::string flag; all >> flag;) {
    const bool matters = flag == "ssse3" || flag == "sse4_2" || flag == "fma" || flag.starts_with("avx");
    kept += matters ? (kept.empty() ? "" : " ") + flag : "";
  }
  return kept;
}

}  // namespace

Machine this_machine() {
  Machine machine;
  machine.cpu = cpu_property("model name");
  machine.flags = flags_that_matter();
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  machine.cores = sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed) : 0;
  utsname system{};
  machine.kernel = uname(&system) == 0 ? system.release : "";
  std::ifstream("/proc/loadavg") >> machine.load;
  return machine;
}

std::string source_revision() {
  FILE* git = popen("git -C '" TUBED_SOURCE_DIR "' describe --always --dirty 2>/dev/null", "r");
  if (git == nullptr) {
    return "unknown";
  }
  std::array<char, 128> line{};
  std::string revision = std::fgets(line.data(), line.size(), git) != nullptr ? line.data() : "unknown\n";
  pclose(git);
  revision.resize(revision.find_last_not_of('\n') + 1);
  return revision;
}

std::string command_line(const std::string& name, int argc, char** argv) {
  std::string line = "./run bench " + name;
  for (int i = 1; i < argc; ++i) line += std::string(" ") + argv[i];
  return line;
}

}  // namespace tubed
