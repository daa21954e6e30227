// Nothing is heard: what runs on this machine and publishes in this domain instead, and what to type to hear
// it.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/subscription.hpp"

namespace tubed {

/// A tubed that runs on this machine.
struct RunningDaemon {
  int pid = 0;
  std::string config;  ///< its configuration file
  std::string why;     ///< why that cannot be read; empty: what follows is known
  Subscription place;  ///< where it publishes; without instrument and keys
  bool has_keys = false;
  std::vector<std::string> instruments;
  std::string estimates_socket;  ///< [shm]; empty: none
};

/// What was found out.
struct Surroundings {
  std::vector<RunningDaemon> daemons;
  /// Where in the domain listened to, on its interface, somebody publishes shapes; "" is the default one.
  std::vector<std::string> partitions;
};

/// The processes named tubed below `proc`.
std::vector<RunningDaemon> running_daemons(const std::filesystem::path& proc = "/proc");

/// Asks DDS who publishes shapes in the domain and on the interface of `subscription`; takes up to 0.7 s.
/// Throws DdsError.
std::vector<std::string> partitions_heard(const Subscription& subscription);

/// A line for each thing that explains why nothing is heard at `wanted` and says what to type: `verb` with
/// other options. At least one line.
std::vector<std::string> words_of_silence(const Subscription& wanted, const std::string& verb,
                                          const Surroundings& found);

/// The same for a reader of shared memory at `socket`.
std::vector<std::string> words_of_silent_socket(const std::string& socket, const std::string& verb,
                                                const std::vector<RunningDaemon>& daemons);

/// Tells a person once, on standard error, when nothing came for two seconds.
class SilenceTeller {
 public:
  SilenceTeller(Subscription subscription, std::string verb);
  /// Of a reader of shared memory.
  SilenceTeller(std::string socket, std::string verb);

  void heard() { is_over_ = true; }
  /// To be called now and then; tells when it is due.
  void tell_when_due();
  /// Tells at once, unless it was told or something was heard.
  void tell();

 private:
  Subscription subscription_;
  std::string socket_;
  std::string verb_;
  std::chrono::steady_clock::time_point due_;
  bool is_over_ = false;
};

}  // namespace tubed
