// Where commands to a running emulator come in.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace tubed::aurora::emulator {

/// A Unix datagram socket that takes one command a datagram; a sender that is bound itself gets an answer:
/// "done", or what was wrong. One thread.
class ControlSocket {
 public:
  /// Binds `path`, replacing what an earlier run left there. Throws std::runtime_error with what to do.
  explicit ControlSocket(const std::filesystem::path& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  /// For poll().
  [[nodiscard]] int descriptor() const noexcept { return socket_; }
  /// The next command that has come, nothing when there is none. Answers it with what `carry_out` returns.
  template <typename CarryOut>
  bool take(CarryOut&& carry_out) {
    std::string sender;
    const std::optional<std::string> command = receive(sender);
    if (command) {
      answer(sender, carry_out(*command));
    }
    return command.has_value();
  }

 private:
  std::optional<std::string> receive(std::string& sender);
  void answer(const std::string& sender, const std::string& why) const;

  int socket_ = -1;
  std::filesystem::path path_;
};

}  // namespace tubed::aurora::emulator
