// A program that runs beside this one and ends with it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace tubed {

/// Started by the constructor, ended by the destructor: SIGTERM, after two seconds SIGKILL. It also ends when
/// this process is killed. One thread.
class ChildProcess {
 public:
  /// `command`: the program's path and its arguments. What it prints goes to `log`, which is made anew.
  /// Throws std::runtime_error when no process can be made; a program that cannot be run exits with 127.
  ChildProcess(const std::vector<std::string>& command, std::filesystem::path log);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// False once the process has ended by itself.
  [[nodiscard]] bool is_running();
  /// What it has printed so far, the last `lines` lines.
  [[nodiscard]] std::vector<std::string> log_tail(std::size_t lines) const;

 private:
  std::filesystem::path log_;
  pid_t process_ = -1;
};

}  // namespace tubed
