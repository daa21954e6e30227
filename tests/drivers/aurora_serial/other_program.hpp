// Another program that has a serial port open, for tests.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>

namespace tubed {

/// A process of that name that has the port open, until the end of the object.
class OtherProgram {
 public:
  enum class Lock { kNone, kRecords, kWholeFile };

  OtherProgram(const char* name, const std::string& port, Lock lock) {
    int told[2];
    if (::pipe(told) != 0 || (process_ = ::fork()) < 0) {
      return;
    }
    if (process_ == 0) {
      has_open(name, port, lock, told[1]);
    }
    char answer = 'n';
    ::close(told[1]);
    has_port_ = ::read(told[0], &answer, 1) == 1 && answer == 'y';
    ::close(told[0]);
  }
  ~OtherProgram() { end(); }
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;

  void end() {
    if (process_ > 0) {
      ::kill(process_, SIGKILL);
      ::waitpid(process_, nullptr, 0);
      process_ = -1;
    }
  }
  /// It opened the port, and has the lock.
  [[nodiscard]] bool has_port() const { return has_port_; }
  [[nodiscard]] int process() const { return process_; }

 private:
  [[noreturn]] static void has_open(const char* name, const std::string& port, Lock lock, int told) {
    ::prctl(PR_SET_NAME, name);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int descriptor = ::open(port.c_str(), O_RDWR | O_NOCTTY);
    struct flock whole_file {};
    whole_file.l_type = F_WRLCK;
    const bool is_good = descriptor >= 0 &&
                         (lock != Lock::kRecords || ::fcntl(descriptor, F_SETLK, &whole_file) == 0) &&
                         (lock != Lock::kWholeFile || ::flock(descriptor, LOCK_EX | LOCK_NB) == 0);
    const char answer = is_good ? 'y' : 'n';
    [[maybe_unused]] const ssize_t size = ::write(told, &answer, 1);
    for (;;) {
      ::pause();
    }
  }

  pid_t process_ = -1;
  bool has_port_ = false;
};

}  // namespace tubed
