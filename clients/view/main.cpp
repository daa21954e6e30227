// tubed-view: the room in a browser, from a process of its own.
#include <malloc.h>

#include <cstdio>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "clients/cpp/limited_log.hpp"
#include "clients/view/ending_signals.hpp"
#include "clients/view/server_options.hpp"
#include "clients/view/view.hpp"
#include "idl/command_line/command_line.hpp"

namespace {

constexpr int kExitUsage = 64;
constexpr int kExitUnavailable = 69;
struct Options {
  tubed::ViewSettings view;
  tubed::ServerOptions server;
  std::vector<std::string> image_sockets;
};

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
  add_server_options(app, options.server);
  app.add_option("--images", options.view.image_folder,
                 "folder of the daemon's previews, [shm] preview_folder")
      .default_str("none");
  app.add_option("--image-socket", options.image_sockets, "CAMERA=PATH: a grabber's own socket instead");
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

int serve(const Options& options, const tubed::EndingSignals& ending) {
  tubed::View view(options.view);
  std::cerr << "tubed-view shows the room at " << address_of(options.server) << '\n';
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
  options.view.server = server_settings(options.server);
  options.view.image_sockets = named_sockets(options.image_sockets);
  const tubed::EndingSignals ending;
  tubed::limit_cyclone_log();
  return serve(options, ending);
}

/// Pictures of 50 KB and more are made by one thread and freed by another, fifteen a second: between small
/// blocks in the threads' heaps they would leave holes. They get pages of their own.
void keep_pictures_off_the_heaps() { mallopt(M_MMAP_THRESHOLD, 32 * 1024); }

}  // namespace

int main(int argc, char** argv) {
  keep_pictures_off_the_heaps();
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
