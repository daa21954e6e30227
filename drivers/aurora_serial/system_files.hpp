// Small files and folders of /proc and /sys, read where nothing may allocate.
#pragma once

#include <dirent.h>

#include <array>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace tubed {

/// Where the kernel and udev tell about devices and processes; a test brings places of its own.
struct SystemPlaces {
  std::string sys = "/sys";
  std::string proc = "/proc";
  std::string dev = "/dev";
};

/// A path put together from a pattern of printf; empty when it is too long. Any thread; never allocates.
class PathText {
 public:
  template <typename... Values>
  explicit PathText(const char* pattern, Values... values) noexcept {
    const int size = std::snprintf(text_.data(), text_.size(), pattern, values...);
    if (size < 0 || static_cast<std::size_t>(size) >= text_.size()) {
      text_[0] = '\0';
    }
  }
  [[nodiscard]] const char* c_str() const noexcept { return text_.data(); }

 private:
  std::array<char, 512> text_{};
};

/// The first line of the file, in `room`, without its end; empty when there is none. Never allocates.
std::string_view read_line(const PathText& path, std::span<char> room) noexcept;

/// Where the symbolic link `name` in `folder` leads, in `room`; empty when it is none. Never allocates.
std::string_view read_link(int folder, const char* name, std::span<char> room) noexcept;

/// Behind the last slash.
std::string_view last_component(std::string_view path) noexcept;

/// The entries of a folder, one after the other. One thread; never allocates, unlike opendir().
class FolderEntries {
 public:
  FolderEntries() = default;
  ~FolderEntries() { close(); }
  FolderEntries(const FolderEntries&) = delete;
  FolderEntries& operator=(const FolderEntries&) = delete;

  /// False: there is no such folder, or it may not be read.
  bool open(const PathText& path) noexcept;
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// Name of the next entry, good until the next call; nullptr at the end.
  const char* next() noexcept;

 private:
  int descriptor_ = -1;
  std::size_t size_ = 0;
  std::size_t at_ = 0;
  alignas(dirent64) std::array<char, 4096> entries_{};
};

}  // namespace tubed
