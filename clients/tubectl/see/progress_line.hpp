// How far something long is, for a terminal and for a log.
#pragma once

#include <unistd.h>

#include <iostream>
#include <string>

namespace tubed {

/// On a terminal a line that is written anew, elsewhere a line for each other text; on standard error.
class ProgressLine {
 public:
  void say(const std::string& words) {
    if (words == said_) return;
    said_ = words;
    if (is_live_) {
      std::cerr << "\r\033[K" << words << ' ' << std::flush;
    } else {
      std::cerr << words << '\n';
    }
  }
  /// What comes next begins a line.
  void end() {
    if (is_live_) std::cerr << '\n';
    said_.clear();
  }

 private:
  bool is_live_ = isatty(STDERR_FILENO) == 1;
  std::string said_;
};

}  // namespace tubed
