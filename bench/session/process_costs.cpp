#include "bench/session/process_costs.hpp"

#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

namespace tubed {

namespace {

namespace fs = std::filesystem;

/// "VmRSS:   1234 kB" -> 1234; 0 when there is no such line.
double number_after(const fs::path& file, const std::string& key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with(key)) return std::strtod(line.c_str() + key.size(), nullptr);
  }
  return 0;
}

std::string first_line(const fs::path& file) {
  std::string line;
  std::ifstream stream(file);
  std::getline(stream, line);
  return line;
}

double cpu_seconds(pid_t process) {
  clockid_t clock{};
  timespec spent{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &spent) != 0) return 0;
  return static_cast<double>(spent.tv_sec) + static_cast<double>(spent.tv_nsec) / 1e9;
}

}  // namespace

ProcessCosts costs_of(pid_t process, double t_s) {
  const fs::path folder = fs::path("/proc") / std::to_string(process);
  ProcessCosts costs;
  costs.t_s = t_s;
  costs.cpu_s = cpu_seconds(process);
  costs.resident_mb = number_after(folder / "status", "VmRSS:") * 1024 / 1e6;
  std::error_code gone;
  for (fs::directory_iterator entry(folder / "fd", gone), end; !gone && entry != end; entry.increment(gone)) {
    costs.descriptors += 1;
  }
  for (fs::directory_iterator entry(folder / "task", gone), end; !gone && entry != end;
       entry.increment(gone)) {
    const double voluntary = number_after(entry->path() / "status", "voluntary_ctxt_switches:");
    const double involuntary = number_after(entry->path() / "status", "nonvoluntary_ctxt_switches:");
    costs.voluntary_switches += voluntary;
    costs.involuntary_switches += involuntary;
    costs.thread_switches[first_line(entry->path() / "comm")] += voluntary + involuntary;
  }
  return costs;
}

}  // namespace tubed
