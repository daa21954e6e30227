// How a segment finds its readers: a Unix socket at which the writer hands out the descriptor to admitted
// readers, and the reader's side of that.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "idl/shm_layout.hpp"

namespace tubed {

struct ShmDoorSettings {
  std::string path;            ///< of the socket; its folder exists and is writable for the writer alone
  std::optional<gid_t> group;  ///< members may read too, beside root and the writer's own user
};

struct ShmDoorCounters {
  std::uint64_t admitted = 0;
  std::uint64_t refused = 0;    ///< neither user nor group
  std::uint64_t throttled = 0;  ///< came too often
};

/// The writer's side. Keeps nothing of a reader: the connection is closed when the descriptor is sent, and a
/// flood of connections costs at most kAnswersAServing answers a call. One thread.
class ShmDoor {
 public:
  static constexpr int kAnswersAServing = 16;
  static constexpr double kBurst = 32;      ///< answers to one user at once,
  static constexpr double kPerSecond = 32;  ///< and from then on

  /// Binds the socket, mode 0600, or 0660 with a group. A socket that a dead writer left is replaced. Throws
  /// ShmError.
  explicit ShmDoor(const ShmDoorSettings& settings);
  ~ShmDoor();
  ShmDoor(const ShmDoor&) = delete;
  ShmDoor& operator=(const ShmDoor&) = delete;

  /// Answers waiting readers, without waiting itself. Call it at least every 100 ms.
  void serve(int descriptor, std::int64_t now_ns) noexcept;

  [[nodiscard]] const ShmDoorCounters& counters() const { return counters_; }

 private:
  struct Visitor {
    uid_t user = 0;
    double answers_left = kBurst;
    std::int64_t last_ns = 0;
    bool is_known = false;
  };

  void answer(int connection, int descriptor, std::int64_t now_ns) noexcept;
  [[nodiscard]] bool may_read(int connection, uid_t user, gid_t group) const noexcept;
  bool comes_too_often(uid_t user, std::int64_t now_ns) noexcept;

  ShmDoorSettings settings_;
  int socket_ = -1;
  ino_t inode_ = 0;  ///< of the socket's name: what we remove is ours
  std::array<Visitor, 32> visitors_{};
  ShmDoorCounters counters_;
};

/// The reader's side: one call at a writer's door. It goes on between two calls of answer(), so that a
/// program that never has time to wait is let in too. One thread.
class ShmVisit {
 public:
  /// `trusted`: the users a writer may run as; empty = any. Throws ShmError: nobody there, not trusted.
  ShmVisit(const std::string& path, const std::vector<uid_t>& trusted);
  ~ShmVisit();
  ShmVisit(const ShmVisit&) = delete;
  ShmVisit& operator=(const ShmVisit&) = delete;

  /// The descriptor, which is the caller's from then on; nothing when the writer does not answer within
  /// `timeout_ms`. Throws ShmError: refused, no writer of tubed's.
  std::optional<int> answer(int timeout_ms);

 private:
  bool knock();

  std::string path_;
  std::vector<uid_t> trusted_;
  int socket_ = -1;
  bool is_waiting_ = false;  ///< connected; before that others fill the queue at the door
};

/// A visit that ends after `timeout_ms`. Throws ShmError: as ShmVisit, or not answering.
int fetch_descriptor(const std::string& path, int timeout_ms, const std::vector<uid_t>& trusted);

}  // namespace tubed
