// tubectl can-gateway: reads an NDI Aurora at a serial port and sends what it measures on a CAN bus.
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/tubectl/verbs.hpp"
#include "drivers/aurora/session.hpp"
#include "drivers/aurora_can/bus_load.hpp"
#include "drivers/aurora_can/can_local_bus.hpp"
#include "drivers/aurora_can/can_packer.hpp"
#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/aurora_serial/tool_folder.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSlice{50};
constexpr milliseconds kBetweenTries{100};
/// A measurement that the bus does not take within this is old.
constexpr milliseconds kTimeoutOfBus{20};
/// Without a measurement for so long the bus is told that there are none.
constexpr milliseconds kTrackerAway{1000};

volatile std::sig_atomic_t interrupted = 0;  // NOLINT: what a signal handler may touch

struct GatewayOptions {
  std::string serial;
  std::string interface;
  std::string layout = "fd";
  std::int64_t base_id = aurora::CanBase::kDefault;
  bool extended = false;
  std::string baud = "115200";
  std::string tool_folder;
  std::vector<std::string> coils = {"1.0", "1.1", "2.0", "2.1", "3.0"};
  double seconds = 0;
  bool print_bus_load = false;
};

aurora::CoilMap coil_map(const std::vector<std::string>& coils) {
  aurora::CoilMap map;
  int sensor = 0;
  for (const std::string& text : coils) {
    int port = 0;
    int channel = 0;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%2d.%1d%c", &port, &channel, &rest) != 2 || port < 1 || channel < 0 ||
        channel > 1 || map.coil_at({port, channel}) || ++sensor > aurora::kMaxCanCoils) {
      throw std::invalid_argument("--coils: '" + text +
                                  "' is no PORT.CHANNEL, as 1.0 or 1.1, is there twice, or is the 17th coil");
    }
    map.place(sensor, {port, channel});
  }
  return map;
}

CanLayout layout_of(const GatewayOptions& options) {
  return options.layout == "fd" ? CanLayout::kFd : CanLayout::kClassic;
}

aurora::CanBase base_of(const GatewayOptions& options) {
  const auto base = can_base(options.base_id, options.extended ? aurora::CanIdentifierSize::kExtended
                                                               : aurora::CanIdentifierSize::kStandard);
  if (!base) {
    throw std::invalid_argument("--base-id: " + std::string(aurora::kWhatCanBasesAre) + " (--extended)");
  }
  return *base;
}

/// Says what is wrong once, until something else is.
class Complaints {
 public:
  void say(const std::string& what) {
    if (what != said_) {
      said_ = what;
      std::cerr << "tubectl can-gateway: " << printable_text(what) << '\n';
    }
  }
  void all_is_well() { said_.clear(); }

 private:
  std::string said_;
};

/// One thread: tracker in, frames out; either end may come and go.
class CanGateway {
 public:
  explicit CanGateway(const GatewayOptions& options)
      : map_(coil_map(options.coils)),
        tools_(options.tool_folder, "--tool-folder"),
        serial_(options.serial),
        bus_(make_can_port(options.interface,
                           layout_of(options) == CanLayout::kFd ? CanUse::kSendFd : CanUse::kSendClassic)),
        session_({.baud = aurora::baud_rate(std::stoi(options.baud)).value(), .poller = {}}, map_,
                 tools_.tools()),
        packer_(layout_of(options), map_.coil_count(), base_of(options)) {}

  /// False when another program has the serial port: two gateways at one would contradict each other.
  bool has_port_to_itself() {
    const int error = serial_.open();
    if (error == EBUSY) {
      trouble_.say(serial_.path() + " " + std::string(describe_open_error(error)));
      return false;
    }
    if (error == 0) {
      session_.attach(serial_);
    }
    return true;
  }

  void run(MonotonicTime end) {
    while (interrupted == 0 && monotonic_now() < end) {
      step();
    }
    if (serial_.is_open()) {
      session_.close();
    }
    send(packer_.pack_away(aurora::CanTrackerState::kGatewayEnds, monotonic_now()));
    std::fprintf(stderr, "%llu measurements sent, %llu not\n", static_cast<unsigned long long>(sent_),
                 static_cast<unsigned long long>(failed_));
  }

 private:
  void step() {
    if (!serial_.is_open()) {
      const int error = serial_.open();
      if (error != 0) {
        trouble_.say(std::string(serial_.explain(error).text()));
        tell_away(aurora::CanTrackerState::kNoPort);
        sleep_until(monotonic_now() + kBetweenTries, MonotonicTime::max());
        return;
      }
      session_.attach(serial_);
    }
    switch (session_.run(monotonic_now() + kSlice, frame_)) {
      case aurora::Session::Event::kMeasurement:
        trouble_.all_is_well();
        last_measurement_ = monotonic_now();
        has_problem_ = false;
        ++(send(packer_.pack(can_report(session_, frame_), last_measurement_)) ? sent_ : failed_);
        return;
      case aurora::Session::Event::kProblem:
        trouble_.say(std::string(session_.problem().text()));
        has_problem_ = true;
        break;
      case aurora::Session::Event::kGone:
        trouble_.say(serial_.path() + " has gone");
        serial_.close();
        return;
      case aurora::Session::Event::kQuiet:
      case aurora::Session::Event::kRefused:
        break;
    }
    const aurora::CanTrackerState state = can_tracker_state(session_);
    has_problem_ = has_problem_ && state != aurora::CanTrackerState::kNoTracker;
    tell_away(has_problem_ ? aurora::CanTrackerState::kNotMeasuring : state);
  }

  void tell_away(aurora::CanTrackerState state) {
    const MonotonicTime now = monotonic_now();
    if (now - last_measurement_ >= kTrackerAway) {
      send(packer_.pack_away(state, now));
    }
  }

  /// True when the bus has taken all of them.
  bool send(std::span<const aurora::CanFrame> frames) {
    if (frames.empty()) {
      return true;
    }
    int error = bus_->open();
    const MonotonicTime until = monotonic_now() + kTimeoutOfBus;
    for (const aurora::CanFrame& frame : frames) {
      error = error == 0 ? bus_->write(frame, until) : error;
    }
    if (error == 0) {
      bus_trouble_.all_is_well();
      return true;
    }
    bus_trouble_.say(std::string(bus_->name()) + " " + std::string(bus_->describe(error)));
    if (error != ENOBUFS) {
      bus_->close();
    }
    return false;
  }

  aurora::CoilMap map_;
  ToolFolder tools_;
  SerialPort serial_;
  std::unique_ptr<CanPort> bus_;
  aurora::Session session_;
  CanPacker packer_;
  EmFrame frame_;
  MonotonicTime last_measurement_{};
  bool has_problem_ = false;  ///< the tracker answers, and the session has told why it does not track
  Complaints trouble_;
  Complaints bus_trouble_;
  std::uint64_t sent_ = 0;
  std::uint64_t failed_ = 0;
};

/// Measurements at 40 Hz, each with its STATUS: a little more than is sent.
void print_bus_load(aurora::CanBase base) {
  constexpr double kMeasurementsPerSecond = 40;
  struct Row {
    const char* name;
    CanLayout layout;
    CanRates rates;
  };
  const std::vector<Row> rows = {{"classic, 500 kbit/s", CanLayout::kClassic, {500e3, 500e3}},
                                 {"classic, 1 Mbit/s", CanLayout::kClassic, {1e6, 1e6}},
                                 {"CAN FD, 500 kbit/s and 2 Mbit/s", CanLayout::kFd, {500e3, 2e6}},
                                 {"CAN FD, 1 and 5 Mbit/s", CanLayout::kFd, {1e6, 5e6}}};
  std::printf("| bus, at the most | 5 coils | | 8 coils | |\n|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    std::printf("| %s |", row.name);
    for (const int coils : {5, 8}) {
      CanPacker packer(row.layout, coils, base);
      const double busy_s = bus_seconds(packer.pack({}, {}), row.rates);
      std::printf(" %.1f %% | %.1f ms |", 100 * kMeasurementsPerSecond * busy_s, 1e3 * busy_s);
    }
    std::printf("\n");
  }
}

/// Throws std::invalid_argument when what the options say cannot be.
int run_gateway(const GatewayOptions& options) {
  if (options.print_bus_load) {
    print_bus_load(base_of(options));
    return kExitOk;
  }
  if (options.serial.empty() || options.interface.empty()) {
    std::cerr << "tubectl can-gateway: --serial and --can are needed\n";
    return kExitUsage;
  }
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  CanGateway gateway(options);
  if (!gateway.has_port_to_itself()) {
    return kExitUnavailable;
  }
  gateway.run(options.seconds > 0 ? monotonic_now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                          std::chrono::duration<double>(options.seconds))
                                  : MonotonicTime::max());
  return kExitOk;
}

}  // namespace

CommandLine add_can_gateway(CommandLine app, int& exit_code) {
  auto options = std::make_shared<GatewayOptions>();
  CommandLine verb = app.add_subcommand(
      "can-gateway", "Read an NDI Aurora at a serial port and send its measurements on a CAN bus");
  verb.add_option("--serial", options->serial, "Port of the tracker");
  verb.add_option("--can", options->interface,
                  "CAN interface, as can0; or the path, with a slash, of a socket to be made, for one "
                  "receiver on this machine");
  verb.add_option("--layout", options->layout, "classic: frames of 8 bytes; fd: of 48, needs CAN FD")
      .is_member({"classic", "fd"})
      .capture_default_str();
  verb.add_option("--base-id", options->base_id,
                  "First of the 128 identifiers that are sent, a multiple of 0x80; the same as "
                  "aurora-can.base_id of the listener")
      .default_str("0x300");
  verb.add_flag("--extended", options->extended, "Identifiers of 29 bits, as aurora-can.extended_ids");
  verb.add_option("--baud", options->baud, "Rate of the serial line while tracking")
      .is_member({"9600", "14400", "19200", "38400", "57600", "115200", "230400", "921600"})
      .capture_default_str();
  verb.add_option("--coils", options->coils, "PORT.CHANNEL of coil 0, 1, ...: sensor 1, 2, ... of the daemon")
      .delimiter(',')
      .default_str("1.0,1.1,2.0,2.1,3.0");
  verb.add_option("--tool-folder", options->tool_folder,
                  "Folder with port-1.rom, port-2.rom, ... for tools without a programmed memory")
      .existing_directory();
  verb.add_option("--seconds", options->seconds, "End after so long; default: at Ctrl-C").in_range(0.0, 1e7);
  verb.add_flag("--bus-load", options->print_bus_load, "Print how busy the bus is, and end");
  verb.callback([options, &exit_code] {
    try {
      exit_code = run_gateway(*options);
    } catch (const std::invalid_argument& error) {
      std::cerr << "tubectl can-gateway: " << error.what() << '\n';
      exit_code = kExitUsage;
    }
  });
  return verb;
}

}  // namespace tubed
