// Lines for systemd's journal with fields beside the words, by its native protocol (systemd.io,
// JOURNAL_NATIVE_PROTOCOL): one datagram an entry, no library.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// A field's name, of A to Z, 0 to 9 and _, and its value, any bytes.
struct JournalField {
  std::string_view name;
  std::string_view value;
};

/// The datagram of one entry. `priority` as syslog counts: 3 error, 4 warning, 6 info, 7 debug.
std::string journal_entry(int priority, std::string_view words, const std::vector<JournalField>& fields);

/// Where entries go; send() may be called by any thread. Never waits: what the journal does not take at once
/// is not sent.
class JournalSocket {
 public:
  /// Of this service, or nothing when `journal_stream` (the environment's JOURNAL_STREAM, null when unset) is
  /// not what `standard_error` is connected to: somebody else reads it then.
  static std::optional<JournalSocket> of_this_service(const char* journal_stream, int standard_error);
  /// Sends to the socket at `path`. Throws std::system_error when there can be no socket.
  explicit JournalSocket(std::string path);
  ~JournalSocket();
  JournalSocket(JournalSocket&& other) noexcept;
  JournalSocket& operator=(JournalSocket&&) = delete;

  /// False when the journal did not take it.
  bool send(const std::string& entry) noexcept;

 private:
  std::string path_;
  int socket_ = -1;
};

}  // namespace tubed
