#include "clients/tubectl/check/doctor_checks.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "daemon/config/load_configuration.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

constexpr unsigned kCapIpcLock = 14;
constexpr unsigned kCapSysNice = 23;
// What the unit asks for; the daemon needs about as much memory, with its libraries.
constexpr std::uint64_t kUsefulPriority = 60;
constexpr std::uint64_t kUsefulLockedBytes = std::uint64_t{1} << 30U;
constexpr int kUsefulBufferBytes = 1 << 20;

std::optional<std::string> first_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  return std::getline(stream, line) ? std::optional(line) : std::nullopt;
}

std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    found.push_back(at->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::int64_t number_of(const std::string& text, std::int64_t otherwise) {
  std::istringstream stream(text);
  std::int64_t number = otherwise;
  return stream >> number ? number : otherwise;
}

Finding kernel(const Machine& machine) {
  if (first_line(machine.root / "sys/kernel/realtime") == "1") {
    return {Verdict::kGood, "the kernel is PREEMPT_RT", ""};
  }
  const std::string version = first_line(machine.root / "proc/version").value_or("");
  const bool preempts = version.find("PREEMPT") != std::string::npos;
  return {
      Verdict::kAdvice,
      preempts ? "the kernel preempts, but not everywhere (no PREEMPT_RT)" : "the kernel is not PREEMPT_RT",
      "rare delays of milliseconds are possible: apt-get install linux-image-rt-amd64"};
}

Finding processors(const Machine& machine) {
  const std::string online = first_line(machine.root / "sys/devices/system/cpu/online").value_or("");
  if (online.empty()) {
    return {Verdict::kNote, "how many CPUs there are is not said", ""};
  }
  if (online == "0") {
    return {Verdict::kWrong, "one CPU only", "acquisition, images and solver need at least two, better four"};
  }
  const std::string isolated = first_line(machine.root / "sys/devices/system/cpu/isolated").value_or("");
  return {Verdict::kGood,
          "CPUs " + online + ", kept free of other work: " + (isolated.empty() ? "none" : isolated), ""};
}

Finding governor(const Machine& machine) {
  std::map<std::string, int> governors;
  for (const fs::path& cpu : entries(machine.root / "sys/devices/system/cpu")) {
    if (const auto name = first_line(cpu / "cpufreq/scaling_governor")) {
      ++governors[*name];
    }
  }
  if (governors.empty()) {
    return {Verdict::kNote, "the CPUs' speed is not in this system's hand (a virtual machine, or fixed)", ""};
  }
  if (governors.size() == 1 && governors.begin()->first == "performance") {
    return {Verdict::kGood, "all CPUs keep their full speed", ""};
  }
  std::string found = "CPUs change their speed:";
  for (const auto& [name, count] : governors) found += " " + std::to_string(count) + " x " + name;
  return {Verdict::kAdvice, found, "apt-get install linux-cpupower; cpupower frequency-set -g performance"};
}

Finding priority(const Machine& machine) {
  if (machine.may_exceed_limits) {
    return {Verdict::kGood, "SCHED_FIFO is allowed to the user who asks here", ""};
  }
  const std::string found =
      "SCHED_FIFO is allowed up to priority " + std::to_string(machine.realtime_priority_limit);
  return machine.realtime_priority_limit >= kUsefulPriority
             ? Finding{Verdict::kGood, found, ""}
             : Finding{Verdict::kAdvice, found + " to the user who asks here",
                       "run tubed as a service (LimitRTPRIO=90), or give this user rtprio 90 in "
                       "/etc/security/limits.d"};
}

Finding locked_memory(const Machine& machine) {
  if (machine.may_exceed_limits || machine.locked_memory_limit >= kUsefulLockedBytes) {
    return {Verdict::kGood, "memory may be locked", ""};
  }
  return {Verdict::kAdvice,
          "only " + std::to_string(machine.locked_memory_limit >> 20U) + " MB of memory may be locked",
          "run tubed as a service (LimitMEMLOCK=infinity), or give this user memlock unlimited in "
          "/etc/security/limits.d"};
}

Finding throttling(const Machine& machine) {
  const std::int64_t runtime_us =
      number_of(first_line(machine.root / "proc/sys/kernel/sched_rt_runtime_us").value_or(""), -1);
  return runtime_us == -1 ? Finding{Verdict::kGood, "real-time threads may use all of a CPU", ""}
                          : Finding{Verdict::kNote,
                                    "real-time threads are stopped after " +
                                        std::to_string(runtime_us / 1000) + " ms of each second at work",
                                    ""};
}

Finding interrupts(const Machine& machine) {
  bool balances = false;
  for (const fs::path& process : entries(machine.root / "proc")) {
    balances = balances || first_line(process / "comm") == "irqbalance";
  }
  const std::string mask = first_line(machine.root / "proc/irq/default_smp_affinity").value_or("unknown");
  if (balances) {
    return {Verdict::kAdvice, "irqbalance moves interrupts between CPUs (default mask " + mask + ")",
            "keep it off the CPUs of [realtime]: IRQBALANCE_BANNED_CPULIST in /etc/default/irqbalance"};
  }
  return {Verdict::kGood, "interrupts stay where they are (default mask " + mask + ")", ""};
}

Finding clock_source(const Machine& machine) {
  const std::string name =
      first_line(machine.root / "sys/devices/system/clocksource/clocksource0/current_clocksource")
          .value_or("unknown");
  const std::set<std::string> quick{"tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page"};
  return quick.contains(name)
             ? Finding{Verdict::kGood, "the clock is read without the kernel (" + name + ")", ""}
             : Finding{Verdict::kAdvice, "reading the clock is slow (" + name + ")",
                       "look for why the kernel gave up tsc: dmesg | grep -i clocksource"};
}

Finding swap(const Machine& machine) {
  std::ifstream stream(machine.root / "proc/swaps");
  std::string heading;
  std::string device;
  std::getline(stream, heading);
  return std::getline(stream, device)
             ? Finding{Verdict::kNote, "there is swap; locked memory never goes there", ""}
             : Finding{Verdict::kGood, "no swap", ""};
}

Finding network_buffer(const Machine& machine) {
  const std::int64_t bytes =
      number_of(first_line(machine.root / "proc/sys/net/core/rmem_max").value_or(""), 0);
  const std::string found = "a socket may keep " + std::to_string(bytes / 1024) + " KiB until it is read";
  return bytes >= kUsefulBufferBytes ? Finding{Verdict::kGood, found, ""}
                                     : Finding{Verdict::kAdvice, found,
                                               "for subscribers on other hosts: sysctl -w "
                                               "net.core.rmem_max=2097152, and in /etc/sysctl.d"};
}

Finding configuration(const Machine& machine) {
  try {
    const Configuration read = load_configuration(machine.configuration);
    if (!read.warnings.empty()) {
      return {Verdict::kAdvice, read.warnings.front(), "tubed --check " + machine.configuration.string()};
    }
    return {Verdict::kGood, machine.configuration.string() + " is in order", ""};
  } catch (const std::exception& error) {
    std::string words = error.what();
    words = words.substr(0, words.find('\n'));
    return {Verdict::kWrong, words, "tubed --check FILE says where; tubed --sample prints one to begin with"};
  }
}

Finding user(const Machine& machine) {
  std::ifstream users(machine.root / "etc/passwd");
  for (std::string line; std::getline(users, line);) {
    if (line.starts_with("tubed:")) {
      return {Verdict::kGood, "user tubed, as whom the service runs, exists", ""};
    }
  }
  return {Verdict::kNote, "no user tubed: the package is not installed, or tubed runs as somebody else", ""};
}

Machine with_limits(Machine machine) {
  rlimit limit{};
  if (getrlimit(RLIMIT_RTPRIO, &limit) == 0) machine.realtime_priority_limit = limit.rlim_cur;
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0) machine.locked_memory_limit = limit.rlim_cur;
  return machine;
}

bool has_capabilities() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("CapEff:")) {
      const std::uint64_t bits = std::strtoull(line.c_str() + 7, nullptr, 16);
      return (bits >> kCapIpcLock & 1U) != 0 && (bits >> kCapSysNice & 1U) != 0;
    }
  }
  return false;
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGood:
      return "good";
    case Verdict::kNote:
      return "note";
    case Verdict::kAdvice:
      return "advice";
    case Verdict::kWrong:
      return "WRONG";
  }
  return "unknown";
}

Machine this_machine(const std::filesystem::path& configuration) {
  Machine machine;
  machine.configuration = configuration;
  machine.may_exceed_limits = has_capabilities();
  return with_limits(machine);
}

const std::vector<DoctorCheck>& doctor_checks() {
  static const std::vector<DoctorCheck> checks{
      {"configuration", configuration},
      {"user", user},
      {"kernel", kernel},
      {"processors", processors},
      {"governor", governor},
      {"priority", priority},
      {"locked memory", locked_memory},
      {"throttling", throttling},
      {"interrupts", interrupts},
      {"clock source", clock_source},
      {"swap", swap},
      {"network buffer", network_buffer},
  };
  return checks;
}

}  // namespace tubed
