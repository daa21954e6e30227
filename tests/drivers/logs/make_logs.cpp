// Writes the wire logs of this folder that come from the emulated Aurora: make_logs FOLDER. In virtual time,
// so that the same logs come every time.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>

#include "drivers/aurora/wire_log.hpp"
#include "drivers/laboratory/aurora_emulator/control.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

/// A host that writes down what goes over the line.
class LoggedHost {
 public:
  explicit LoggedHost(const std::string& about, const DeviceSettings& settings = {}) : host_(settings) {
    log_.header = {about, "from the emulated Aurora, in virtual time"};
    baud(9600);
  }

  void baud(int rate) {
    host_.rate = rate;
    WireLogEntry entry = entry_of(WireEvent::kBaudRate);
    entry.bits_per_second = rate;
    log_.entries.push_back(entry);
  }
  void serial_break() {
    log_.entries.push_back(entry_of(WireEvent::kBreak));
    host_.device.receive_break(host_.now);
    hear(seconds(3));
  }
  /// Sends a command and writes down what comes back within `timeout`.
  void ask(const CommandLine& command, std::chrono::nanoseconds timeout = seconds(4)) {
    WireLogEntry entry = entry_of(WireEvent::kSent);
    entry.bytes.assign(command.bytes().begin(), command.bytes().end());
    log_.entries.push_back(entry);
    host_.send(command.bytes());
    hear(timeout);
    host_.now += milliseconds(5);
  }
  void ask(std::string_view name, std::string_view parameters) { ask(with_crc(name, parameters)); }
  void control(const std::string& command) {
    const std::string why = apply_control(command, host_.device, host_.now);
    WireLogEntry entry = entry_of(WireEvent::kNote);
    entry.note = "emulator told: " + command + (why.empty() ? "" : ", but " + why);
    log_.entries.push_back(entry);
  }
  void poll(int times, const CommandLine& command) {
    for (int i = 0; i < times; ++i) {
      ask(command, milliseconds(200));
      host_.now += milliseconds(20);
    }
  }
  /// From power-on to 115200 baud, INIT done.
  void begin() {
    hear(seconds(3));
    ask(init_command());
    LinkParameters fast;
    fast.rate = BaudRate::k115200;
    ask(comm_command(fast));
    baud(115200);
  }
  void track() {
    begin();
    for (const char* handle : {"0A", "0B", "0C"}) {
      ask("PINIT", handle);
    }
    for (const char* handle : {"0AD", "0BD", "0CD", "0DD", "0ED"}) {
      ask("PENA", handle);
    }
    ask(tstart_command());
  }
  [[nodiscard]] const WireLog& log() const { return log_; }

 private:
  WireLogEntry entry_of(WireEvent event) const {
    WireLogEntry entry;
    entry.time = host_.now - kPowerOn;
    entry.event = event;
    return entry;
  }
  void hear(std::chrono::nanoseconds timeout) {
    const MonotonicTime deadline = host_.now + timeout;
    while (host_.device.next_event() <= deadline) {
      host_.now =
          std::max(host_.now, host_.device.next_event()) + milliseconds(4);  // portions, as an adapter gives
      WireLogEntry entry = entry_of(WireEvent::kReceived);
      host_.device.transmit(host_.now, host_.rate, entry.bytes);
      if (!entry.bytes.empty()) {
        log_.entries.push_back(entry);
      }
    }
  }

  Host host_;
  WireLog log_;
};

const CommandLine kBx = bx_command(kTransforms | kAlsoOutOfVolume);
const CommandLine kTx = tx_command(kTransforms | kAlsoOutOfVolume);

WireLog two_coils_on_a_plug() {
  LoggedHost host("two coils on each of two plugs: the second handle of a plug comes with its PINIT");
  host.begin();
  host.ask("VER", "4");
  host.ask(apirev_command());
  host.ask(phsr_command(HandleQuery::kToBeInitialised));
  host.ask(pinit_command(0x0A));
  host.ask(phsr_command(HandleQuery::kToBeEnabled));
  host.ask(pinit_command(0x0B));
  host.ask(pinit_command(0x0C));
  host.ask(phsr_command(HandleQuery::kToBeInitialised));
  for (std::uint8_t handle = 0x0A; handle <= 0x0E; ++handle) {
    host.ask(phinf_command(handle, kToolField | kPartNumberField | kLocationField));
    host.ask(pena_command(handle, TrackingPriority::kDynamic));
  }
  host.ask(tstart_command());
  host.poll(4, kBx);
  host.ask(tstop_command());
  host.ask(comm_command({}));
  host.baud(9600);
  return host.log();
}

WireLog text_with_coils_that_fail() {
  LoggedHost host("text replies: a coil broken, one outside the volume, one not seen");
  host.track();
  host.poll(1, kTx);
  for (const char* command : {"break-coil 1", "move-coil-out 2", "lose-coil 3"}) {
    host.control(command);
    host.poll(2, kTx);
  }
  host.poll(1, tx_command(kTransforms));
  return host.log();
}

WireLog unplugged_and_plugged_again() {
  LoggedHost host("a plug is pulled and put in again while tracking: system status 0080, then 00C0");
  host.track();
  host.poll(2, kBx);
  host.control("unplug 2");
  host.poll(2, kBx);
  host.poll(1, kTx);
  host.control("plug 2");
  host.poll(2, kBx);
  host.ask(phsr_command(HandleQuery::kToBeFreed));  // refused while tracking
  host.ask(tstop_command());
  host.ask(phsr_command(HandleQuery::kToBeFreed));
  host.ask(phinf_command(0x0B, kLocationField));
  host.ask(phf_command(0x0B));
  host.ask(phf_command(0x0E));
  host.ask(phsr_command(HandleQuery::kToBeInitialised));
  return host.log();
}

WireLog a_tool_without_description() {
  DeviceSettings settings;
  settings.plugs = two_coils_a_port(1);
  settings.plugs[0].memory = ToolMemory::kBlank;
  settings.durations.pinit = milliseconds(2500);
  LoggedHost host("ERROR13 after 2.5 s, until PVWR has written the tool's description", settings);
  host.begin();
  host.ask(pinit_command(0x0A));
  // As recorded: what cannot be initialised is listed all the same.
  host.ask(phsr_command(HandleQuery::kToBeEnabled));
  host.ask(tstart_command());
  host.poll(1, tx_command(kTransforms));
  host.ask(tstop_command());
  const std::vector<std::uint8_t> block(kToolMemoryBlock, 0xA5);
  for (int i = 0; i < 16; ++i) {
    host.ask(pvwr_command(0x0A, static_cast<std::uint16_t>(64 * i), block));
  }
  host.ask(pinit_command(0x0A));
  return host.log();
}

WireLog one_of_every_damage() {
  LoggedHost host("each fault of a reply once, a good reply after each, binary and text");
  host.track();
  for (const CommandLine& command : {kBx, kTx}) {
    for (const char* fault : {"crc", "header-crc", "length", "truncate", "drop", "garbage", "no-reply",
                              "error", "duplicate", "stale", "delay", "split"}) {
      host.control(std::string("fault ") + fault + " next 1");
      host.poll(2, command);
    }
  }
  return host.log();
}

WireLog power_lost_while_tracking() {
  LoggedHost host(
      "the tracker loses power for a second: RESET comes at 9600 baud, noise to a host at 115200");
  host.track();
  host.poll(2, kBx);
  host.control("power-cycle 1");
  host.poll(3, kBx);
  host.ask(kBx);
  host.baud(9600);
  host.serial_break();
  host.ask(init_command());
  host.ask(kBx);
  return host.log();
}

}  // namespace
}  // namespace tubed::aurora::emulator

int main(int argc, char** argv) {
  using namespace tubed::aurora;
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_logs FOLDER\n");
    return 64;
  }
  const std::map<std::string, std::function<WireLog()>> logs = {
      {"two_coils_on_a_plug", emulator::two_coils_on_a_plug},
      {"text_with_coils_that_fail", emulator::text_with_coils_that_fail},
      {"unplugged_and_plugged_again", emulator::unplugged_and_plugged_again},
      {"a_tool_without_description", emulator::a_tool_without_description},
      {"one_of_every_damage", emulator::one_of_every_damage},
      {"power_lost_while_tracking", emulator::power_lost_while_tracking}};
  for (const auto& [name, make] : logs) {
    std::ofstream(std::filesystem::path(argv[1]) / (name + ".log"), std::ios::binary)
        << format_wire_log(make());
  }
  return 0;
}
