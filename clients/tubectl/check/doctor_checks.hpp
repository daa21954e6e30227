// What a machine should have for a catheter to be tracked on time, check by check. Reads files below a root,
// so that a test can bring a machine of its own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tubed {

/// How much a finding matters. kNote: nothing to do, but it explains delays.
enum class Verdict { kGood, kNote, kAdvice, kWrong };

/// "good", "note", "advice", "WRONG".
std::string_view name_of(Verdict verdict);

/// What one check came to.
struct Finding {
  Verdict verdict = Verdict::kGood;
  std::string found;   ///< what is, in one sentence
  std::string advice;  ///< what to do; empty when nothing
};

/// The machine that is examined.
struct Machine {
  std::filesystem::path root = "/";  ///< /proc, /sys, /etc and /dev are looked for below it
  std::filesystem::path configuration = "/etc/tubed/tubed.toml";  ///< as named; not below `root`
  std::uint64_t realtime_priority_limit = 0;                      ///< RLIMIT_RTPRIO of this process
  std::uint64_t locked_memory_limit = 0;                          ///< RLIMIT_MEMLOCK, bytes
  bool may_exceed_limits = false;  ///< CAP_SYS_NICE and CAP_IPC_LOCK are at hand
};

/// This machine, as it is.
Machine this_machine(const std::filesystem::path& configuration);

/// One check: its name, and the function that looks. None throws because of what it finds or misses.
struct DoctorCheck {
  const char* name;
  Finding (*look)(const Machine& machine);
};

/// All checks, in the order in which they are shown; a further device adds a line here.
const std::vector<DoctorCheck>& doctor_checks();

}  // namespace tubed
