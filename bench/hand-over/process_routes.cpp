#include "bench/hand-over/process_routes.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "idl/shm_reader.hpp"
#include "idl/shm_writer.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kTimeoutNs = 50'000'000;
constexpr std::uint32_t kContent = 99;  // neither estimates nor images

std::vector<std::byte> block_of(std::size_t bytes) { return std::vector<std::byte>(bytes, std::byte{7}); }

class RingSender final : public Sender {
 public:
  RingSender(const std::string& socket, std::size_t bytes)
      : block_(block_of(bytes)),
        writer_({{socket, {}}, {4, bytes}, {kContent, 1, "bench", 0}}, monotonic_ns()) {}
  void send(std::uint32_t number) override {
    std::memcpy(block_.data(), &number, sizeof number);
    writer_.publish(block_, monotonic_ns());
  }

 private:
  std::vector<std::byte> block_;
  ShmWriter writer_;
};

class RingReceiver final : public Receiver {
 public:
  RingReceiver(const std::string& socket, std::size_t bytes) : block_(block_of(bytes)) {
    settings_.path = socket;
    settings_.content = kContent;
    settings_.content_version = 1;
  }
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    std::optional<ShmReader> reader;
    while (!reader && !is_over()) connect(reader);
    while (!is_over()) {
      if (reader->news(monotonic_ns()) != ShmNews::kSample) {
        reader->sleep_until(monotonic_ns() + kTimeoutNs);
        continue;
      }
      const ShmSample sample = reader->take_next();
      if (sample.copy(0, block_) && sample.whole()) {
        std::uint32_t number = 0;
        std::memcpy(&number, block_.data(), sizeof number);
        arrived(number, monotonic_ns());
      }
    }
  }

 private:
  void connect(std::optional<ShmReader>& reader) const {
    try {
      reader.emplace(settings_);
    } catch (const ShmError&) {  // the sender is not there yet
      sleep_until_ns(monotonic_ns() + 10'000'000);
    }
  }

  std::vector<std::byte> block_;
  ShmReaderSettings settings_;
};

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  return address;
}

class SocketSender final : public Sender {
 public:
  SocketSender(const std::string& path, std::size_t bytes)
      : block_(block_of(bytes)), door_(socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    const sockaddr_un address = address_of(path);
    unlink(path.c_str());
    if (bind(door_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        listen(door_, 64) != 0) {
      throw std::runtime_error("cannot listen at " + path);
    }
  }
  ~SocketSender() override {
    for (const int receiver : receivers_) close(receiver);
    close(door_);
  }
  SocketSender(const SocketSender&) = delete;
  SocketSender& operator=(const SocketSender&) = delete;

  void send(std::uint32_t number) override {
    if (number == 0) let_in();
    std::memcpy(block_.data(), &number, sizeof number);
    for (const int receiver : receivers_) write_all(receiver);
  }

 private:
  void let_in() {
    const int size = static_cast<int>(2 * block_.size());
    for (int receiver = 0; (receiver = accept4(door_, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
      setsockopt(receiver, SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
      receivers_.push_back(receiver);
    }
  }
  void write_all(int receiver) const {
    for (std::size_t done = 0; done < block_.size();) {
      const ssize_t count = ::send(receiver, block_.data() + done, block_.size() - done, MSG_NOSIGNAL);
      if (count <= 0) return;
      done += static_cast<std::size_t>(count);
    }
  }

  std::vector<std::byte> block_;
  int door_;
  std::vector<int> receivers_;
};

class SocketReceiver final : public Receiver {
 public:
  SocketReceiver(std::string path, std::size_t bytes) : block_(block_of(bytes)), path_(std::move(path)) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    const int connection = connect(is_over);
    std::size_t have = 0;
    pollfd waiting{connection, POLLIN, 0};
    while (!is_over()) {
      if (poll(&waiting, 1, 50) <= 0) continue;
      const ssize_t count = recv(connection, block_.data() + have, block_.size() - have, 0);
      if (count <= 0) break;
      have += static_cast<std::size_t>(count);
      if (have == block_.size()) {
        std::uint32_t number = 0;
        std::memcpy(&number, block_.data(), sizeof number);
        arrived(number, monotonic_ns());
        have = 0;
      }
    }
    close(connection);
  }

 private:
  [[nodiscard]] int connect(const std::function<bool()>& is_over) const {
    const sockaddr_un address = address_of(path_);
    const int connection = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    while (!is_over() &&
           ::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      sleep_until_ns(monotonic_ns() + 10'000'000);
    }
    return connection;
  }

  std::vector<std::byte> block_;
  std::string path_;
};

}  // namespace

Route shm_ring(const std::filesystem::path& folder, std::size_t payload_bytes) {
  const std::string path = (folder / ("ring-" + std::to_string(payload_bytes) + ".sock")).string();
  return {"shm", Placement::kProcesses, [=] { return std::make_unique<RingSender>(path, payload_bytes); },
          [=] { return std::make_unique<RingReceiver>(path, payload_bytes); }};
}

Route unix_socket(const std::filesystem::path& folder, std::size_t payload_bytes) {
  const std::string path = (folder / ("stream-" + std::to_string(payload_bytes) + ".sock")).string();
  return {"unix-socket", Placement::kProcesses,
          [=] { return std::make_unique<SocketSender>(path, payload_bytes); },
          [=] { return std::make_unique<SocketReceiver>(path, payload_bytes); }};
}

}  // namespace tubed
