#include "clients/tubectl/see/child_process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace tubed {

namespace {

[[noreturn]] void become(const std::vector<char*>& arguments, const std::filesystem::path& log) {
  // It must not outlive a program that was killed.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  dup2(file, STDOUT_FILENO);
  dup2(file, STDERR_FILENO);
  setsid();
  execv(arguments.front(), arguments.data());
  _exit(127);
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command, std::filesystem::path log)
    : log_(std::move(log)) {
  std::vector<char*> arguments;
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));  // execv changes nothing of them
  }
  arguments.push_back(nullptr);
  process_ = fork();
  if (process_ < 0) {
    throw std::runtime_error("cannot start " + command.front() + ": " + std::strerror(errno));
  }
  if (process_ == 0) {
    become(arguments, log_);
  }
}

ChildProcess::~ChildProcess() {
  if (process_ <= 0) {
    return;
  }
  kill(process_, SIGTERM);
  int status = 0;
  for (int tries = 0; tries < 300 && waitpid(process_, &status, WNOHANG) == 0; ++tries) {
    usleep(10'000);
    if (tries == 200) {
      kill(process_, SIGKILL);
    }
  }
}

bool ChildProcess::is_running() {
  int status = 0;
  if (process_ > 0 && waitpid(process_, &status, WNOHANG) == process_) {
    process_ = -1;
  }
  return process_ > 0;
}

std::vector<std::string> ChildProcess::log_tail(std::size_t lines) const {
  std::vector<std::string> all;
  std::ifstream log(log_);
  for (std::string line; std::getline(log, line);) {
    all.push_back(line);
  }
  if (all.size() > lines) {
    all.erase(all.begin(), all.end() - static_cast<std::ptrdiff_t>(lines));
  }
  return all;
}

}  // namespace tubed
