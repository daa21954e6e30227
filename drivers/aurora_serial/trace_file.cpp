#include "drivers/aurora_serial/trace_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <optional>

#include "drivers/aurora/wire_log.hpp"
#include "drivers/aurora/words.hpp"

namespace tubed {

namespace {

/// A file that is written from a room of fixed size.
class PlainFile {
 public:
  explicit PlainFile(const std::string& path) noexcept
      : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640)) {}
  ~PlainFile() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
  }
  PlainFile(const PlainFile&) = delete;
  PlainFile& operator=(const PlainFile&) = delete;

  void put(std::string_view text) noexcept {
    for (const char c : text) {
      if (size_ == room_.size()) {
        flush();
      }
      room_[size_++] = c;
    }
  }
  bool flush() noexcept {
    good_ =
        good_ && descriptor_ >= 0 && ::write(descriptor_, room_.data(), size_) == static_cast<ssize_t>(size_);
    size_ = 0;
    return good_;
  }

 private:
  int descriptor_;
  bool good_ = true;
  std::size_t size_ = 0;
  std::array<char, 16384> room_{};
};

}  // namespace

TraceFolder::TraceFolder(const std::string& folder, const std::string& prefix) {
  if (folder.empty()) {
    return;
  }
  const std::string stem = folder + "/" + prefix + "-";
  request_ = stem + "request";
  answer_ = stem + "request.log";
  for (std::size_t i = 1; i <= kFiles; ++i) {
    files_.push_back(stem + std::to_string(i) + ".log");
  }
}

bool TraceFolder::write(const aurora::WireTrace& trace, std::string_view about) noexcept {
  if (files_.empty()) {
    return false;
  }
  const std::string& file = files_[next_];
  next_ = (next_ + 1) % files_.size();
  return write_to(file, trace, about);
}

bool TraceFolder::asked_for() noexcept { return !request_.empty() && ::unlink(request_.c_str()) == 0; }

bool TraceFolder::write_on_request(const aurora::WireTrace& trace, std::string_view about) noexcept {
  return !answer_.empty() && write_to(answer_, trace, about);
}

bool TraceFolder::write_to(const std::string& path, const aurora::WireTrace& trace,
                           std::string_view about) noexcept {
  PlainFile file(path);
  file.put(aurora::kWireLogTitle);
  file.put("\n# ");
  file.put(about);
  file.put("\n");
  std::optional<MonotonicTime> began;
  std::array<char, aurora::kMaxWireLogLine> line;
  trace.each([&](const aurora::WireRecord& record) {
    if (!began) {
      began = record.time;
      std::array<char, 24> digits{};
      const auto end = std::to_chars(digits.begin(), digits.end(), to_ns(*began)).ptr;
      file.put("# time 0 is CLOCK_MONOTONIC ");
      file.put({digits.data(), static_cast<std::size_t>(end - digits.data())});
      file.put(" ns\n");
    }
    file.put(aurora::format_wire_record(record, *began, line));
  });
  return file.flush();
}

}  // namespace tubed
