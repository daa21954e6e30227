// Serves the second emulated Aurora on a pseudo-terminal in real time, for clients that open a serial port.
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "tests/second_aurora/second_aurora.hpp"

namespace {

using namespace tubed::second_aurora;

constexpr const char* kUsage =
    "usage: second_aurora_pty [--coils 2,2,1] [--link PATH] [--seed N] [--fault "
    "NAME:PROBABILITY[:MILLISECONDS]]...\n"
    "Prints the path of the terminal. SIGUSR1 stands for a serial break, which a pseudo-terminal does not "
    "carry.\n"
    "SIGINT and SIGTERM print what was served and end it. Names of faults:";

volatile std::sig_atomic_t break_wanted = 0, end_wanted = 0;

std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * kSecond_ns + time.tv_nsec;
}

template <typename Number>
Number number_in(const std::string& text, const std::string& option) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw std::invalid_argument(option + ": " + text + " is no number");
  }
  return value;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char letter : text) {
    if (letter == separator) {
      parts.emplace_back();
    } else {
      parts.back() += letter;
    }
  }
  return parts;
}

Fault fault_of(const std::string& text) {
  const std::vector<std::string> parts = split(text, ':');
  const auto name = std::find(kFaultNames.begin(), kFaultNames.end(), parts[0]);
  if (name == kFaultNames.end() || parts.size() < 2 || parts.size() > 3) {
    throw std::invalid_argument("--fault " + text +
                                ": write NAME:PROBABILITY[:MILLISECONDS] with a name of --help");
  }
  Fault fault;
  fault.kind = static_cast<FaultKind>(name - kFaultNames.begin());
  fault.probability = number_in<double>(parts[1], "--fault");
  if (parts.size() == 3) {
    fault.duration_ns = number_in<int>(parts[2], "--fault") * kMillisecond_ns;
  }
  return fault;
}

struct Options {
  Settings settings;
  std::string link;
};

void plug_in(Settings& settings, const std::string& coils_of_ports) {
  settings.ports.clear();
  for (const std::string& coils : split(coils_of_ports, ',')) {
    Tool tool;
    tool.coils = number_in<int>(coils, "--coils");
    tool.serial += static_cast<std::uint32_t>(settings.ports.size());
    settings.ports.push_back(tool.coils == 0 ? std::nullopt : std::optional(tool));
  }
}

Options options_in(int argc, char** argv) {
  Options options;
  plug_in(options.settings, "2,2,1,0");
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string option = argv[i], value = argv[i + 1];
    if (option == "--coils") {
      plug_in(options.settings, value);
    } else if (option == "--link") {
      options.link = value;
    } else if (option == "--seed") {
      options.settings.seed = number_in<std::uint64_t>(value, option);
    } else if (option == "--fault") {
      options.settings.faults.push_back(fault_of(value));
    } else {
      throw std::invalid_argument(option + " is no option; --help names them");
    }
  }
  if (argc % 2 == 0) {
    throw std::invalid_argument(std::string(argv[argc - 1]) + " wants a value; --help names the options");
  }
  return options;
}

// What the client set on its side of the terminal.
int baud_of(int terminal) {
  static constexpr std::pair<speed_t, int> kRates[] = {{B9600, 9600},    {B19200, 19200},   {B38400, 38400},
                                                       {B57600, 57600},  {B115200, 115200}, {B230400, 230400},
                                                       {B921600, 921600}};
  termios settings{};
  tcgetattr(terminal, &settings);
  const speed_t speed = cfgetospeed(&settings);
  for (const auto& [known, baud] : kRates) {
    if (known == speed) {
      return baud;
    }
  }
  return 1200;
}

// The coils of each plug circle in the middle of the volume.
Pose circling(int port, int channel, std::int64_t time_ns) {
  const double angle = 1e-9 * static_cast<double>(time_ns % (1000 * kSecond_ns)) + port + 0.1 * channel;
  return {1, 0, 0, 0, 80 * std::cos(angle), 80 * std::sin(angle), -250 - 10.0 * port, 0.1};
}

int open_terminal(int& client_side, const std::string& link) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0) {
    throw std::runtime_error(std::string("cannot open a pseudo-terminal: ") + std::strerror(errno));
  }
  const std::string path = ptsname(terminal);
  // Kept open so that the terminal outlives its clients.
  client_side = open(path.c_str(), O_RDWR | O_NOCTTY);
  termios raw{};
  tcgetattr(client_side, &raw);
  cfmakeraw(&raw);
  cfsetspeed(&raw, B9600);
  tcsetattr(client_side, TCSANOW, &raw);
  if (!link.empty()) {
    unlink(link.c_str());
    if (symlink(path.c_str(), link.c_str()) != 0) {
      throw std::runtime_error("--link " + link + ": " + std::strerror(errno));
    }
  }
  std::printf("%s\n", path.c_str());
  std::fflush(stdout);
  return terminal;
}

void serve(SecondAurora& device, int terminal) {
  while (end_wanted == 0) {
    const std::int64_t wait_ns =
        std::clamp<std::int64_t>(device.next_event_ns() - now_ns(), 0, 100 * kMillisecond_ns);
    const timespec wait{0, wait_ns};
    pollfd readable{terminal, POLLIN, 0};
    ppoll(&readable, 1, &wait, nullptr);
    const int baud = baud_of(terminal);
    if (std::exchange(break_wanted, 0) != 0) {
      device.serial_break(now_ns());
    }
    std::uint8_t bytes[512];
    const ssize_t count = read(terminal, bytes, sizeof bytes);
    if (count > 0) {
      device.hear(std::span(bytes, static_cast<std::size_t>(count)), baud, now_ns());
    }
    std::vector<std::uint8_t> out;
    device.speak(now_ns(), baud, out);
    if (!out.empty() && write(terminal, out.data(), out.size()) != static_cast<ssize_t>(out.size())) {
      std::fprintf(stderr, "nobody reads the terminal: a reply is lost\n");
    }
  }
}

void print_counts(const Counts& counts) {
  std::printf("%llu commands, %llu tracking replies, %llu measurements\n",
              static_cast<unsigned long long>(counts.commands),
              static_cast<unsigned long long>(counts.tracking_replies),
              static_cast<unsigned long long>(counts.measurements));
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    if (counts.struck[kind] != 0) {
      std::printf("%s struck %llu times\n", std::string(kFaultNames[kind]).c_str(),
                  static_cast<unsigned long long>(counts.struck[kind]));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "--help") {
    std::printf("%s", kUsage);
    for (const std::string_view name : kFaultNames) {
      std::printf(" %s", std::string(name).c_str());
    }
    std::printf("\n");
    return 0;
  }
  try {
    const Options options = options_in(argc, argv);
    std::signal(SIGUSR1, [](int) { break_wanted = 1; });
    std::signal(SIGINT, [](int) { end_wanted = 1; });
    std::signal(SIGTERM, [](int) { end_wanted = 1; });
    SecondAurora device(options.settings, circling, now_ns());
    int client_side = -1;
    const int terminal = open_terminal(client_side, options.link);
    serve(device, terminal);
    print_counts(device.counts());
    if (!options.link.empty()) {
      unlink(options.link.c_str());
    }
    close(client_side);
    close(terminal);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "second_aurora_pty: %s\n", error.what());
    return 2;
  }
  return 0;
}
