#include "drivers/aurora_serial/system_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <utility>

namespace tubed {

std::string_view read_line(const PathText& path, std::span<char> room) noexcept {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) {
    return {};
  }
  const ssize_t size = ::read(file, room.data(), room.size());
  ::close(file);
  const std::string_view text(room.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  return text.substr(0, text.find('\n'));
}

std::string_view read_link(int folder, const char* name, std::span<char> room) noexcept {
  const ssize_t size = ::readlinkat(folder, name, room.data(), room.size());
  return {room.data(), size > 0 ? static_cast<std::size_t>(size) : 0};
}

std::string_view last_component(std::string_view path) noexcept {
  return path.substr(path.rfind('/') + 1);  // npos + 1 is 0
}

bool FolderEntries::open(const PathText& path) noexcept {
  close();
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  return is_open();
}

void FolderEntries::close() noexcept {
  if (is_open()) {
    ::close(std::exchange(descriptor_, -1));
  }
  size_ = at_ = 0;
}

const char* FolderEntries::next() noexcept {
  if (at_ >= size_) {
    const ssize_t size = is_open() ? ::getdents64(descriptor_, entries_.data(), entries_.size()) : 0;
    size_ = size > 0 ? static_cast<std::size_t>(size) : 0;
    at_ = 0;
  }
  if (at_ >= size_) {
    return nullptr;
  }
  const auto* const entry = reinterpret_cast<const dirent64*>(entries_.data() + at_);
  at_ += entry->d_reclen;
  return entry->d_name;
}

}  // namespace tubed
