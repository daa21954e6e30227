// What a running process has cost so far, as /proc tells it.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <string>

namespace tubed {

struct ProcessCosts {
  double t_s = 0;          ///< when it was looked at, by the caller's count
  double cpu_s = 0;        ///< of all threads
  double resident_mb = 0;  ///< VmRSS, 10^6 bytes
  double descriptors = 0;
  double voluntary_switches = 0;  ///< context switches of all threads
  double involuntary_switches = 0;
  std::map<std::string, double> thread_switches;  ///< by thread name
};

/// Zeros when there is no such process.
ProcessCosts costs_of(pid_t process, double t_s);

}  // namespace tubed
