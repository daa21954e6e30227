// tubed-view: the room in a browser, from a process of its own.
#include <csignal>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "clients/cpp/limited_log.hpp"
#include "clients/view/view.hpp"
#include "idl/command_line/command_line.hpp"

namespace {

constexpr int kExitUsage = 64;
constexpr int kExitUnavailable = 69;
constexpr std::size_t kMaxVesselBytes = std::size_t{64} << 20U;
constexpr std::size_t kMinTokenLetters = 16;

struct Options {
  tubed::ViewSettings view;
  std::string listen = "127.0.0.1:8080";
  std::vector<std::string> hosts;
  std::vector<std::string> image_sockets;
  std::string token_file;
  std::string vessel;
};

std::string content_of(const std::string& file, std::size_t max_bytes) {
  std::ifstream in(file, std::ios::binary);
  std::string content(max_bytes + 1, '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(in.gcount()));
  if (content.empty()) throw std::invalid_argument("cannot read " + file + ", or it is empty");
  if (content.size() > max_bytes) {
    throw std::invalid_argument(file + " has more than " + std::to_string(max_bytes) + " bytes");
  }
  return content;
}

std::string read_token(const std::string& file) {
  std::string token = content_of(file, 256);
  token.erase(token.find_last_not_of(" \r\n") + 1);
  const bool is_plain =
      token.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_") ==
      std::string::npos;
  if (token.size() < kMinTokenLetters || !is_plain) {
    throw std::invalid_argument(
        file + " has no token: at least 16 letters, digits, - or _; openssl rand -hex 16 makes one");
  }
  return token;
}

/// The settings of the server. Throws std::invalid_argument for what would let in everybody.
tubed::WebServerSettings server_settings(const Options& options) {
  tubed::WebServerSettings server;
  server.where = tubed::parse_listen_address(options.listen);
  server.access.hosts = server.where.host_names();
  for (const std::string& host : options.hosts) server.access.hosts.push_back(host);
  if (!options.token_file.empty()) server.access.token = read_token(options.token_file);
  if (!server.where.is_loopback() && server.access.token.empty()) {
    throw std::invalid_argument(
        "--listen " + options.listen +
        " can be reached from other machines: give --token-file FILE, or listen on 127.0.0.1 or on "
        "unix:/PATH behind a proxy");
  }
  if (!options.vessel.empty()) server.vessel = content_of(options.vessel, kMaxVesselBytes);
  return server;
}

std::map<std::string, std::string> named_sockets(const std::vector<std::string>& words) {
  std::map<std::string, std::string> sockets;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw std::invalid_argument("--image-socket " + word + ": expected CAMERA=PATH");
    }
    sockets[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return sockets;
}

void add_options(tubed::CommandLine& app, Options& options) {
  tubed::Subscription& subscription = options.view.subscription;
  app.add_option("--listen", options.listen, "ADDRESS:PORT or unix:/PATH to serve the page at")
      .capture_default_str();
  app.add_option("--host", options.hosts,
                 "further name, with its port, under which browsers may ask: that of a proxy");
  app.add_option("--token-file", options.token_file, "file with the token that /?token=TOKEN has to name");
  app.add_option("--images", options.view.image_folder,
                 "folder of the daemon's previews, [shm] preview_folder")
      .default_str("none");
  app.add_option("--image-socket", options.image_sockets, "CAMERA=PATH: a grabber's own socket instead");
  app.add_option("--vessel", options.vessel, "STL file of the vessel, world frame, mm");
  app.add_option("--domain", subscription.domain, "DDS domain of the daemon")
      .in_range(0, 230)
      .capture_default_str();
  app.add_option("--partition", subscription.partition, "the room, as in the daemon's configuration");
  app.add_option("--interface", subscription.network_interface, "network interface, name or address")
      .capture_default_str();
  app.add_option("--security", subscription.security,
                 "folder with keys of its own, made by `tubectl keys`: DDS Security on");
  app.add_option("--demo-folder", options.view.demo_folder,
                 "control sockets of a simulation: buttons break things")
      .group("Demonstration");
  app.add_option("--demo-camera", options.view.demo_cameras, "a simulated camera").group("Demonstration");
}

/// SIGTERM and SIGINT, taken by a thread that does nothing else.
class EndingSignals {
 public:
  EndingSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
  }
  void wait() const {
    int signal = 0;
    sigwait(&signals_, &signal);
  }

 private:
  sigset_t signals_{};
};

int serve(const Options& options, const EndingSignals& ending) {
  tubed::View view(options.view);
  std::cerr << "tubed-view shows the room at " << (options.listen.starts_with("unix:") ? "" : "http://")
            << options.listen << '\n';
  std::thread waiting([&] {
    ending.wait();
    view.stop();
  });
  view.run();
  waiting.join();
  return 0;
}

int run(int argc, char** argv) {
  tubed::Program program("Shows the room of a tubed in a browser. Research software, not a medical device.",
                         "tubed-view");
  tubed::CommandLine app = program.command_line();
  Options options;
  add_options(app, options);
  program.set_version("tubed-view " TUBED_VERSION);
  if (const auto ended = program.parse(argc, argv)) return *ended;
  options.view.server = server_settings(options);
  options.view.image_sockets = named_sockets(options.image_sockets);
  const EndingSignals ending;
  tubed::limit_cyclone_log();
  return serve(options, ending);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "tubed-view: %s\n", error.what());
    return kExitUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tubed-view: %s\n", error.what());
    return kExitUnavailable;
  }
}
