// A writer of shared memory that does to it what an input says: its door, its segment, and every word in it.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "idl/shm_ring.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace tubed::fuzz {

/// The door answers in a thread of its own; a reader that connects waits for it.
class ForeignDoor {
 public:
  explicit ForeignDoor(const std::string& name)
      : path_("/tmp/tubed-fuzz-" + name + "-" + std::to_string(getpid()) + ".sock") {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
    unlink(path_.c_str());
    socket_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    demand(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
           listen(socket_, 64) == 0);
    std::thread([this] { serve(); }).detach();
  }

  [[nodiscard]] const std::string& path() const { return path_; }
  /// What the next readers that connect are given. Called between two connections.
  void hand_out(int descriptor, const std::vector<std::byte>& greeting) {
    const std::scoped_lock lock(mutex_);
    descriptor_ = descriptor;
    greeting_ = greeting;
  }

 private:
  void serve() {
    while (true) {
      const int connection = accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
      if (connection >= 0) {
        answer(connection);
        close(connection);
      }
    }
  }

  void answer(int connection) {
    const std::scoped_lock lock(mutex_);  // the next input waits until this one's answer is out
    iovec part{greeting_.data(), greeting_.size()};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))]{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    if (descriptor_ >= 0) {
      message.msg_control = control;
      message.msg_controllen = sizeof(control);
      cmsghdr* rights = CMSG_FIRSTHDR(&message);
      rights->cmsg_level = SOL_SOCKET;
      rights->cmsg_type = SCM_RIGHTS;
      rights->cmsg_len = CMSG_LEN(sizeof(int));
      std::memcpy(CMSG_DATA(rights), &descriptor_, sizeof(descriptor_));
    }
    sendmsg(connection, &message, MSG_NOSIGNAL);
  }

  std::string path_;
  int socket_ = -1;
  std::mutex mutex_;
  int descriptor_ = -1;
  std::vector<std::byte> greeting_;
};

/// Sealed memory as a writer of tubed makes it, and writable from here.
class ForeignSegment {
 public:
  ForeignSegment(const ShmGeometry& geometry, const ShmIdentity& identity, std::int64_t now_ns)
      : bytes_(geometry.segment_bytes()), descriptor_(memfd_create("fuzz", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
    demand(descriptor_ >= 0 && fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes_)) == 0);
    void* place = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    demand(place != MAP_FAILED);
    memory_ = static_cast<std::byte*>(place);
    fchmod(descriptor_, S_IRUSR);
    fcntl(descriptor_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL);
    ring_.emplace(memory_, geometry, identity, now_ns);
  }
  ~ForeignSegment() {
    munmap(memory_, bytes_);
    close(descriptor_);
  }
  ForeignSegment(const ForeignSegment&) = delete;
  ForeignSegment& operator=(const ForeignSegment&) = delete;

  [[nodiscard]] int descriptor() const { return descriptor_; }
  ShmRingWriter& ring() { return *ring_; }
  /// Overwrites some bytes anywhere in the segment, most often in its header and the heads of slots.
  void poke(FuzzInput& input) {
    const std::size_t offset = input.take<std::uint16_t>() % bytes_;
    input.take_into(std::span(memory_ + offset, std::min<std::size_t>(8, bytes_ - offset)));
  }

 private:
  std::size_t bytes_;
  int descriptor_;
  std::byte* memory_ = nullptr;
  std::optional<ShmRingWriter> ring_;
};

/// A greeting of tubed's, or what the input has for one.
inline std::vector<std::byte> greeting_of(FuzzInput& input, bool is_tubeds) {
  tubed_shm_greeting greeting{TUBED_SHM_MAGIC, TUBED_SHM_LAYOUT_VERSION, TUBED_SHM_WELCOME};
  if (!is_tubeds) {
    input.take_into(std::as_writable_bytes(std::span(&greeting, 1)));
  }
  const auto bytes = std::as_bytes(std::span(&greeting, 1));
  return {bytes.begin(), bytes.end()};
}

}  // namespace tubed::fuzz
