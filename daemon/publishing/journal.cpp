#include "daemon/publishing/journal.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <system_error>
#include <utility>

namespace tubed {

namespace {

constexpr const char* kJournal = "/run/systemd/journal/socket";

void append(std::string& entry, std::string_view name, std::string_view value) {
  entry += name;
  if (value.find('\n') == std::string_view::npos) {
    entry += '=';
  } else {
    // Several lines: the length, 64 bit and little-endian, in front of them.
    entry += '\n';
    for (unsigned shift = 0; shift < 64; shift += 8) {
      entry += static_cast<char>(std::uint64_t{value.size()} >> shift & 0xffU);
    }
  }
  entry += value;
  entry += '\n';
}

}  // namespace

std::string journal_entry(int priority, std::string_view words, const std::vector<JournalField>& fields) {
  std::string entry;
  append(entry, "PRIORITY", std::to_string(priority));
  append(entry, "SYSLOG_IDENTIFIER", "tubed");
  append(entry, "MESSAGE", words);
  for (const JournalField& field : fields) {
    append(entry, field.name, field.value);
  }
  return entry;
}

std::optional<JournalSocket> JournalSocket::of_this_service(const char* journal_stream, int standard_error) {
  struct stat status {};
  if (journal_stream == nullptr || fstat(standard_error, &status) != 0 ||
      journal_stream != std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino)) {
    return {};
  }
  return JournalSocket(kJournal);
}

JournalSocket::JournalSocket(std::string path)
    : path_(std::move(path)), socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  if (socket_ < 0) {
    throw std::system_error(errno, std::generic_category(), "cannot make a socket for the journal");
  }
}

JournalSocket::~JournalSocket() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

JournalSocket::JournalSocket(JournalSocket&& other) noexcept
    : path_(std::move(other.path_)), socket_(std::exchange(other.socket_, -1)) {}

bool JournalSocket::send(const std::string& entry) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy_n(path_.data(), std::min(path_.size(), sizeof(address.sun_path) - 1), address.sun_path);
  // Addressed each time: a journal that was restarted has another socket behind the same name.
  const ssize_t sent = sendto(socket_, entry.data(), entry.size(), MSG_NOSIGNAL,
                              reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  return sent == static_cast<ssize_t>(entry.size());
}

}  // namespace tubed
