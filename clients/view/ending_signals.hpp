// What ends a program that serves pages.
#pragma once

#include <pthread.h>

#include <csignal>

namespace tubed {

/// SIGTERM and SIGINT, taken by a thread that does nothing else. Made before any other thread,
/// which would be ended by them.
class EndingSignals {
 public:
  EndingSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
  }
  void wait() const {
    int signal = 0;
    sigwait(&signals_, &signal);
  }

 private:
  sigset_t signals_{};
};

}  // namespace tubed
