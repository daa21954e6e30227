#include "drivers/aurora_serial/port_holder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <charconv>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

PortHolder program_of(const SystemPlaces& places, int process) noexcept {
  std::array<char, 64> room{};
  const PathText name("%s/%d/comm", places.proc.c_str(), process);
  return {process, BoundedText<32>(read_line(name, room))};
}

void PortHolderSearch::begin() noexcept {
  processes_.close();
  files_.close();
  seen_ = found_ = {};
}

void PortHolderSearch::look(dev_t device, MonotonicTime deadline) noexcept {
  if (!processes_.is_open()) {
    processes_.open(PathText("%s", places_.proc.c_str()));
  }
  do {
    const char* const file = files_.next();
    if (file == nullptr) {
      if (!next_process()) {
        found_ = seen_;
        seen_ = {};
        processes_.close();
        return;
      }
    } else if (seen_.process == 0 && is_device(file, device)) {
      seen_ = program_of(places_, process_);
    }
  } while (monotonic_now() < deadline);
}

/// Processes of others, whose files may not be seen, are passed by.
bool PortHolderSearch::next_process() noexcept {
  files_.close();
  while (const char* const name = processes_.next()) {
    const std::string_view text(name);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), process_);
    if (error == std::errc() && end == text.data() + text.size() && process_ != ::getpid() &&
        files_.open(PathText("%s/%d/fd", places_.proc.c_str(), process_))) {
      return true;
    }
  }
  return false;
}

/// Only what is in /dev is asked for its device number: a file elsewhere may be on a server that does not
/// answer.
bool PortHolderSearch::is_device(const char* entry, dev_t device) const noexcept {
  std::array<char, 64> room{};
  if (!read_link(files_.descriptor(), entry, room).starts_with("/dev/")) {
    return false;
  }
  struct stat file {};
  return ::fstatat(files_.descriptor(), entry, &file, 0) == 0 && S_ISCHR(file.st_mode) &&
         file.st_rdev == device;
}

}  // namespace tubed
