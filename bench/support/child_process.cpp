#include "bench/support/child_process.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <system_error>

namespace tubed {

namespace {

pid_t fork_or_throw() {
  std::fflush(nullptr);
  const pid_t id = fork();
  if (id < 0) throw std::system_error(errno, std::generic_category(), "cannot start a process");
  if (id == 0) prctl(PR_SET_PDEATHSIG, SIGKILL);
  return id;
}

std::vector<int> allowed_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cpus;
  if (sched_getaffinity(0, sizeof set, &set) == 0) {
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
    }
  }
  return cpus;
}

}  // namespace

ChildProcess::ChildProcess(const std::function<void()>& work) : id_(fork_or_throw()) {
  if (id_ != 0) return;
  int code = 0;
  try {
    work();
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    code = 1;
  }
  std::fflush(nullptr);
  _exit(code);
}

ChildProcess::ChildProcess(const std::vector<std::string>& command, const std::filesystem::path& log,
                           const std::function<void()>& prepare)
    : id_(fork_or_throw()) {
  if (id_ != 0) return;
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  dup2(file, STDOUT_FILENO);
  dup2(file, STDERR_FILENO);
  if (prepare) prepare();
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  execvp(words.front(), words.data());
  std::perror(words.front());
  _exit(127);
}

ChildProcess::~ChildProcess() { stop(); }

int ChildProcess::wait() {
  int status = 0;
  while (id_ > 0 && waitpid(id_, &status, 0) < 0 && errno == EINTR) {
  }
  id_ = -1;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

void ChildProcess::stop() {
  if (id_ <= 0) return;
  kill(id_, SIGTERM);
  int status = 0;
  for (int tries = 0; tries < 300; ++tries) {
    if (waitpid(id_, &status, WNOHANG) == id_) {
      id_ = -1;
      return;
    }
    usleep(10'000);
  }
  kill(id_, SIGKILL);
  wait();
}

bool ChildProcess::is_running() const {
  siginfo_t info{};
  return id_ > 0 && waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == 0;
}

SharedMemory::SharedMemory(std::size_t bytes)
    : memory_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0)),
      bytes_(bytes) {
  if (memory_ == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "no shared memory");
}

SharedMemory::~SharedMemory() {
  if (memory_ != nullptr) munmap(memory_, bytes_);
}

bool stay_on_cpu(int cpu) {
  const std::vector<int> cpus = allowed_cpus();
  if (cpus.empty()) return false;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(cpus[static_cast<std::size_t>(cpu) % cpus.size()]), &set);
  return sched_setaffinity(0, sizeof set, &set) == 0;
}

int usable_cpus() { return static_cast<int>(allowed_cpus().size()); }

}  // namespace tubed
