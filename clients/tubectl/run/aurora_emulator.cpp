// tubectl aurora-emulator: an NDI Aurora at a pseudo-terminal, to see a driver work without
// one.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/tubectl/run/simulation_settings.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/laboratory/aurora_emulator/control.hpp"
#include "drivers/laboratory/aurora_emulator/serial_front.hpp"
#include "drivers/laboratory/aurora_emulator/truth_log.hpp"
#include "drivers/laboratory/simulated_tracker.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

namespace {

namespace emulator = aurora::emulator;

struct EmulatorOptions {
  std::string sequence;
  std::string configuration;
  std::string link;
  std::string control;
  std::string truth;
  std::vector<std::string> commands;
  std::vector<int> blank_ports;
  std::vector<int> unused_channel_ports;
  std::int64_t epoch_ns = 0;
  double seconds = 0;
  bool slow_pinit = false;
  bool phinf_refused = false;
  std::string api_revision{emulator::Firmware::kCurrent.api_revision};
  emulator::DeviceSettings device;
};

volatile std::sig_atomic_t interrupted = 0;  // NOLINT: what a signal handler may touch

/// What the tracker measures, and how many coils that are.
struct Measurable {
  emulator::Motion motion;
  int sensors = 0;
};

int sensors_of(const RoomDescription& room) {
  int sensors = 0;
  for (const CoilPlacement& coil : tracked_coils(room)) {
    sensors = std::max(sensors, coil.sensor);
  }
  return sensors;
}

Measurable from_sequence(const std::string& folder, MonotonicTime start) {
  const Sequence sequence = read_sequence(folder);
  std::vector<emulator::RecordedCoils> rows;
  for (const SequenceMeasurement& measurement : sequence.measurements) {
    rows.push_back({measurement.t_s, measurement.coils});
  }
  return {emulator::play_recording(std::move(rows), start), sensors_of(sequence.room)};
}

DriverSettings default_simulation(MonotonicTime start) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : simulation_settings()) {
    values[setting.name] = setting.default_value;
  }
  return DriverSettings(std::move(values)).with("epoch_ns", to_ns(start));
}

/// One catheter with five coils; the tracker's frame is the world's.
RoomDescription default_room() {
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  int sensor = 0;
  for (const double offset_mm : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    catheter.coils.push_back({++sensor, offset_mm, false});
  }
  RoomDescription room;
  room.instruments = {catheter};
  return room;
}

Measurable from_simulation(const RoomDescription& room, const DriverSettings& settings, double rate_hz) {
  const auto world = std::make_shared<const SimulatedWorld>(room, settings);
  const auto tracker = std::make_shared<const SimulatedTracker>(*world, settings, 1 / rate_hz);
  const auto motion = [world, tracker](std::uint64_t k, MonotonicTime time) {
    emulator::MeasuredCoils coils;
    tracker->measure_all(*world, static_cast<std::int64_t>(k), world->seconds(time), coils);
    return coils;
  };
  return {motion, sensors_of(room)};
}

/// The catheters of a daemon's configuration, moved as its simulated fluoroscope shows them.
Measurable from_configuration(const std::string& file, double rate_hz) {
  const Configuration configuration = load_configuration(file);
  const DriverSettings* const simulation = simulation_in(configuration);
  if (simulation == nullptr) {
    throw std::runtime_error(
        file +
        ": no camera with driver = \"simulation\", so that there is no motion to emulate; "
        "play a sequence folder with --play instead");
  }
  return from_simulation(configuration.room, *simulation, rate_hz);
}

Measurable measurable(const EmulatorOptions& options, MonotonicTime start) {
  if (!options.sequence.empty()) {
    return from_sequence(options.sequence, start);
  }
  if (!options.configuration.empty()) {
    return from_configuration(options.configuration, options.device.rate_hz);
  }
  return from_simulation(default_room(), default_simulation(start), options.device.rate_hz);
}

emulator::Plug& plug_of(int port, const std::string& option, emulator::DeviceSettings& settings) {
  if (port < 1 || port > static_cast<int>(settings.plugs.size())) {
    throw std::runtime_error(option + " " + std::to_string(port) + ": only ports 1 to " +
                             std::to_string(settings.plugs.size()) + " have a tool");
  }
  return settings.plugs[static_cast<std::size_t>(port - 1)];
}

emulator::DeviceSettings device_settings(const EmulatorOptions& options, int sensors) {
  emulator::DeviceSettings settings = options.device;
  settings.plugs = emulator::two_coils_a_port(sensors);
  settings.firmware = *std::find_if(
      emulator::kFirmwares.begin(), emulator::kFirmwares.end(),
      [&options](const auto& firmware) { return firmware.api_revision == options.api_revision; });
  settings.phinf_while_tracking = options.phinf_refused ? emulator::PhinfWhileTracking::kRefused
                                                        : emulator::PhinfWhileTracking::kAnswered;
  if (options.slow_pinit) {
    settings.durations.pinit = std::chrono::milliseconds(2500);
  }
  for (const int port : options.blank_ports) {
    plug_of(port, "--blank-port", settings).memory = emulator::ToolMemory::kBlank;
  }
  for (const int port : options.unused_channel_ports) {
    emulator::Plug& plug = plug_of(port, "--unused-channel", settings);
    if (plug.sensors.size() == 1) {
      plug.sensors.push_back(0);
    }
  }
  return settings;
}

void print_counts(emulator::Device& device) {
  const auto& counts = device.counts();
  std::fprintf(stderr, "%llu commands, %llu replies, %llu of them with measurements\n",
               static_cast<unsigned long long>(counts.commands),
               static_cast<unsigned long long>(counts.replies),
               static_cast<unsigned long long>(counts.tracking_replies));
  for (std::size_t i = 0; i < emulator::kFaultCount; ++i) {
    const auto fault = static_cast<emulator::Fault>(i);
    if (device.faults().struck(fault) > 0) {
      std::fprintf(stderr, "%s: %llu\n", std::string(emulator::fault_name(fault)).c_str(),
                   static_cast<unsigned long long>(device.faults().struck(fault)));
    }
  }
}

void apply_options(const EmulatorOptions& options, emulator::Device& device, MonotonicTime now) {
  for (const std::string& command : options.commands) {
    if (const std::string why = emulator::apply_control(command, device, now); !why.empty()) {
      throw std::runtime_error("--command '" + command + "': " + why);
    }
  }
}

/// Runs until the time is over or a signal comes. Says where the port is whenever it has a new name.
void run(emulator::SerialFront& front, MonotonicTime end) {
  std::string said;
  while (interrupted == 0 && monotonic_now() < end) {
    if (front.path() != said && !front.path().empty()) {
      said = front.path();
      std::cout << said << std::endl;
    }
    if (const std::string complaint = front.step(); !complaint.empty()) {
      std::cerr << "tubectl aurora-emulator: " << complaint << '\n';
    }
  }
}

int emulate(const EmulatorOptions& options) {
  const MonotonicTime start = options.epoch_ns > 0 ? from_ns(options.epoch_ns) : monotonic_now();
  const Measurable measured = measurable(options, start);
  emulator::Device device(device_settings(options, measured.sensors), measured.motion, monotonic_now());
  std::optional<emulator::TruthLog> truth;
  if (!options.truth.empty()) {
    truth.emplace(options.truth, measured.sensors);
    device.measurements().on_measurement = [&truth](const emulator::Measurement& one) { truth->write(one); };
  }
  apply_options(options, device, monotonic_now());
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  emulator::SerialFront front(device, options.link, options.control);
  const bool for_ever = options.seconds <= 0;
  run(front, for_ever ? MonotonicTime::max()
                      : monotonic_now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double>(options.seconds)));
  print_counts(device);
  return kExitOk;
}

std::vector<std::string> api_revisions() {
  std::vector<std::string> revisions;
  for (const emulator::Firmware& firmware : emulator::kFirmwares) {
    revisions.emplace_back(firmware.api_revision);
  }
  return revisions;
}

void add_options(CommandLine verb, EmulatorOptions& options) {
  Argument play = verb.add_option("--play", options.sequence, "Sequence folder to play, again and again");
  verb.add_option("--config", options.configuration,
                  "A daemon's configuration with a simulated camera: the same motion as that shows")
      .excludes(play);
  verb.add_option("--link", options.link, "Symbolic link to the port, there while the port is");
  verb.add_option("--control", options.control, "Socket to be made for commands (Unix datagrams)");
  verb.add_option("--truth", options.truth, "Write what is measured and when to this file, CSV");
  verb.add_option("--command", options.commands,
                  "A command at the start, as 'fault crc 0.01 any' or 'plug 7 3C4B00FF'; may be given again");
  verb.add_option("--blank-port", options.blank_ports, "The tool on that port has no description: ERROR13");
  verb.add_option("--unused-channel", options.unused_channel_ports,
                  "The tool on that port, if it has one coil, has a second that is always missing");
  verb.add_option("--epoch-ns", options.epoch_ns, "CLOCK_MONOTONIC at which the motion begins; default: now");
  verb.add_option("--seconds", options.seconds, "End after so long; default: at Ctrl-C").in_range(0.0, 1e7);
  verb.add_option("--rate-hz", options.device.rate_hz, "Measurements a second")
      .in_range(1.0, 1000.0)
      .capture_default_str();
  verb.add_option("--first-frame", options.device.first_frame, "Frame counter at power-on and after INIT")
      .capture_default_str();
  verb.add_option("--seed", options.device.seed, "Of all that happens by chance").capture_default_str();
  verb.add_flag("--slow-pinit", options.slow_pinit, "PINIT takes 2.5 s, as with a tool whose memory is read");
  verb.add_option(
          "--firmware", options.api_revision,
          "API revision: before D.001.007 no GETINFO, before D.001.006 no 230400 baud and more, before "
          "D.001.005 no BX")
      .is_member(api_revisions())
      .capture_default_str();
  verb.add_flag("--phinf-refused", options.phinf_refused, "Refuse PHINF while tracking: ERROR0C");
}

}  // namespace

CommandLine add_aurora_emulator(CommandLine app, int& exit_code) {
  auto options = std::make_shared<EmulatorOptions>();
  CommandLine verb = app.add_subcommand(
      "aurora-emulator",
      "Be an NDI Aurora at a pseudo-terminal, whose path is printed; with faults on request");
  add_options(verb, *options);
  verb.callback([options, &exit_code] { exit_code = emulate(*options); });
  return verb;
}

}  // namespace tubed
