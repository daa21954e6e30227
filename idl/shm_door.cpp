#include "idl/shm_door.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tubed {

namespace {

constexpr int kBacklog = 64;

[[noreturn]] void fail(const std::string& what, const std::string& advice = "") {
  throw ShmError(what + ": " + std::strerror(errno) + advice);
}

/// A descriptor that is closed whatever happens.
class Closing {
 public:
  explicit Closing(int descriptor) : descriptor_(descriptor) {}
  ~Closing() {
    if (descriptor_ >= 0) {
      close(descriptor_);
    }
  }
  Closing(const Closing&) = delete;
  Closing& operator=(const Closing&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }
  int release() { return std::exchange(descriptor_, -1); }

 private:
  int descriptor_;
};

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    throw ShmError("the path of a socket has 1 to 107 bytes: '" + path + "'");
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

int open_socket() {
  const int descriptor = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) {
    fail("cannot make a socket");
  }
  return descriptor;
}

int connect_to(int socket, const sockaddr_un& address) {
  return connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
}

/// Removes the name that a dead writer left; a living one, or a file that is no socket, stays.
void remove_stale(const std::string& path, const sockaddr_un& address) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) {
    return;
  }
  if (!S_ISSOCK(status.st_mode)) {
    throw ShmError("'" + path + "' exists and is no socket; name another path");
  }
  const Closing probe(open_socket());
  if (connect_to(probe.get(), address) == 0 || errno != ECONNREFUSED) {
    throw ShmError("another writer serves '" + path + "'; end it or name another path");
  }
  unlink(path.c_str());
}

bool is_member(int connection, gid_t wanted) {
  std::array<gid_t, 1024> groups{};
  socklen_t length = sizeof(groups);
  if (getsockopt(connection, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &length) != 0) {
    return false;  // also ERANGE: a user of more groups than that is let in through his primary group only
  }
  const auto* end = groups.data() + length / sizeof(gid_t);
  return std::find(static_cast<const gid_t*>(groups.data()), end, wanted) != end;
}

union ControlBuffer {
  cmsghdr header;
  char bytes[CMSG_SPACE(sizeof(int))];
};

void send_answer(int connection, tubed_shm_answer answer, int descriptor) noexcept {
  tubed_shm_greeting greeting{TUBED_SHM_MAGIC, TUBED_SHM_LAYOUT_VERSION, static_cast<std::uint32_t>(answer)};
  iovec part{&greeting, sizeof(greeting)};
  ControlBuffer control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  if (answer == TUBED_SHM_WELCOME) {
    message.msg_control = control.bytes;
    message.msg_controllen = sizeof(control.bytes);
    cmsghdr* rights = CMSG_FIRSTHDR(&message);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(rights), &descriptor, sizeof(descriptor));
  }
  // A reader that does not take it has gone; that is its own affair.
  static_cast<void>(sendmsg(connection, &message, MSG_NOSIGNAL | MSG_DONTWAIT));
}

/// The descriptor of a received message, -1 without one.
int received_descriptor(msghdr& message) {
  const cmsghdr* rights = CMSG_FIRSTHDR(&message);
  if (rights == nullptr || rights->cmsg_level != SOL_SOCKET || rights->cmsg_type != SCM_RIGHTS ||
      rights->cmsg_len != CMSG_LEN(sizeof(int))) {
    return -1;
  }
  int descriptor = -1;
  std::memcpy(&descriptor, CMSG_DATA(rights), sizeof(descriptor));
  return descriptor;
}

/// What the writer at `path` handed out. Throws ShmError when that is nothing.
int take_answer(int socket, const std::string& path) {
  tubed_shm_greeting greeting{};
  iovec part{&greeting, sizeof(greeting)};
  ControlBuffer control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes;
  // Room for one descriptor and no more: what else is sent the kernel closes. CMSG_SPACE() has room for two.
  message.msg_controllen = CMSG_LEN(sizeof(int));
  const ssize_t received = recvmsg(socket, &message, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  Closing descriptor(received >= 0 ? received_descriptor(message) : -1);
  if (received != sizeof(greeting) || greeting.magic != TUBED_SHM_MAGIC) {
    throw ShmError("what answers at '" + path + "' is not tubed's shared memory");
  }
  if (greeting.answer == TUBED_SHM_NOT_ALLOWED) {
    throw ShmError("the writer at '" + path + "' refuses this user; join the group of the socket");
  }
  if (greeting.answer == TUBED_SHM_TOO_OFTEN) {
    throw ShmError("the writer at '" + path + "' was asked too often; wait a second");
  }
  if (descriptor.get() < 0) {
    throw ShmError("the writer at '" + path + "' handed nothing out");
  }
  return descriptor.release();
}

}  // namespace

ShmDoor::ShmDoor(const ShmDoorSettings& settings) : settings_(settings) {
  const sockaddr_un address = address_of(settings.path);
  remove_stale(settings.path, address);
  Closing bound(open_socket());
  if (bind(bound.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    fail("cannot bind '" + settings.path + "'", "; does its folder exist and may this user write there?");
  }
  // Before listen(): until then nobody can connect, whatever the umask was.
  const mode_t mode = settings.group ? S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP : S_IRUSR | S_IWUSR;
  const bool is_owned =
      !settings.group || chown(settings.path.c_str(), static_cast<uid_t>(-1), *settings.group) == 0;
  struct stat status {};
  if (!is_owned || chmod(settings.path.c_str(), mode) != 0 || lstat(settings.path.c_str(), &status) != 0 ||
      listen(bound.get(), kBacklog) != 0) {
    const int error = errno;
    unlink(settings.path.c_str());
    errno = error;
    fail("cannot serve '" + settings.path + "'", "; is this user a member of the group?");
  }
  inode_ = status.st_ino;
  socket_ = bound.release();
}

ShmDoor::~ShmDoor() {
  struct stat status {};
  if (lstat(settings_.path.c_str(), &status) == 0 && status.st_ino == inode_) {
    unlink(settings_.path.c_str());
  }
  close(socket_);
}

void ShmDoor::serve(int descriptor, std::int64_t now_ns) noexcept {
  for (int i = 0; i < kAnswersAServing; ++i) {
    const Closing connection(accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (connection.get() < 0) {
      return;
    }
    answer(connection.get(), descriptor, now_ns);
  }
}

void ShmDoor::answer(int connection, int descriptor, std::int64_t now_ns) noexcept {
  ucred peer{};
  socklen_t length = sizeof(peer);
  const bool is_somebody = getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &peer, &length) == 0;
  if (!is_somebody || !may_read(connection, peer.uid, peer.gid)) {
    ++counters_.refused;
    send_answer(connection, TUBED_SHM_NOT_ALLOWED, -1);
  } else if (comes_too_often(peer.uid, now_ns)) {
    ++counters_.throttled;
    send_answer(connection, TUBED_SHM_TOO_OFTEN, -1);
  } else {
    ++counters_.admitted;
    send_answer(connection, TUBED_SHM_WELCOME, descriptor);
  }
}

bool ShmDoor::may_read(int connection, uid_t user, gid_t group) const noexcept {
  return user == 0 || user == geteuid() ||
         (settings_.group && (group == *settings_.group || is_member(connection, *settings_.group)));
}

bool ShmDoor::comes_too_often(uid_t user, std::int64_t now_ns) noexcept {
  // Known visitor, else a free place, else the one not seen for longest.
  Visitor* place =
      std::min_element(visitors_.begin(), visitors_.end(), [&](const Visitor& a, const Visitor& b) {
        const auto rank = [&](const Visitor& visitor) {
          return visitor.is_known ? (visitor.user == user ? 0 : 2) : 1;
        };
        return std::pair(rank(a), a.last_ns) < std::pair(rank(b), b.last_ns);
      });
  if (!place->is_known || place->user != user) {
    *place = {user, kBurst, now_ns, true};
  }
  const double elapsed_s = static_cast<double>(std::max<std::int64_t>(now_ns - place->last_ns, 0)) * 1e-9;
  place->answers_left = std::min(kBurst, place->answers_left + elapsed_s * kPerSecond);
  place->last_ns = now_ns;
  if (place->answers_left < 1) {
    return true;
  }
  place->answers_left -= 1;
  return false;
}

ShmVisit::ShmVisit(const std::string& path, const std::vector<uid_t>& trusted)
    : path_(path), trusted_(trusted) {
  Closing opened(open_socket());
  socket_ = opened.get();
  is_waiting_ = knock();
  opened.release();  // an exception closes it, the destructor does not run then
}

ShmVisit::~ShmVisit() { close(socket_); }

/// False when the queue at the door is full.
bool ShmVisit::knock() {
  if (connect_to(socket_, address_of(path_)) != 0) {
    if (errno == EAGAIN) {
      return false;
    }
    if (errno == ENOENT || errno == ECONNREFUSED) {
      throw ShmError("nobody writes at '" + path_ + "'; start the writer or correct the path");
    }
    fail("cannot connect to '" + path_ + "'", errno == EACCES ? "; join the group of the socket" : "");
  }
  ucred peer{};
  socklen_t length = sizeof(peer);
  if (getsockopt(socket_, SOL_SOCKET, SO_PEERCRED, &peer, &length) != 0) {
    fail("cannot learn who writes at '" + path_ + "'");
  }
  if (!trusted_.empty() && std::find(trusted_.begin(), trusted_.end(), peer.uid) == trusted_.end()) {
    throw ShmError("the writer at '" + path_ + "' is user " + std::to_string(peer.uid) +
                   ", who is not trusted");
  }
  return true;
}

std::optional<int> ShmVisit::answer(int timeout_ms) {
  int left_ms = timeout_ms;
  while (!is_waiting_ && !(is_waiting_ = knock())) {
    if (left_ms <= 0) {
      return {};
    }
    poll(nullptr, 0, 1);
    --left_ms;
  }
  pollfd readable{socket_, POLLIN, 0};
  return poll(&readable, 1, left_ms) > 0 ? std::optional<int>(take_answer(socket_, path_)) : std::nullopt;
}

int fetch_descriptor(const std::string& path, int timeout_ms, const std::vector<uid_t>& trusted) {
  const std::optional<int> descriptor = ShmVisit(path, trusted).answer(timeout_ms);
  if (!descriptor) {
    throw ShmError("the writer at '" + path + "' does not answer within " + std::to_string(timeout_ms) +
                   " ms; it hangs or others besiege it");
  }
  return *descriptor;
}

}  // namespace tubed
