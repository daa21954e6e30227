#include "clients/tubectl/check/doctor_can.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "drivers/aurora/coil_map.hpp"
#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/aurora_can/can_local_bus.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

constexpr std::chrono::seconds kListenedFor{3};
constexpr double kUsualRateHz = 40;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

unsigned long long number(std::uint64_t count) { return count; }

bool is_can(const Configuration& configuration) { return configuration.em_source.driver == "aurora-can"; }

bool is_interface(const std::string& device) { return device.find('/') == std::string::npos; }

/// A unit or drop-in that names AF_CAN among the families it allows.
bool lets_can_in(const std::filesystem::path& file) {
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("RestrictAddressFamilies=") && line.find("AF_CAN") != std::string::npos) {
      return true;
    }
  }
  return false;
}

/// Of tubed.service, tubed@.service and their drop-ins.
bool some_unit_lets_can_in(const std::filesystem::path& root) {
  constexpr auto kSkip = std::filesystem::directory_options::skip_permission_denied;
  std::error_code none;
  for (const auto& folder : {root / "lib/systemd/system", root / "etc/systemd/system"}) {
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder, kSkip, none)) {
      const std::string unit = file.path().lexically_relative(folder).begin()->string();
      if ((unit.starts_with("tubed.service") || unit.starts_with("tubed@")) && lets_can_in(file.path())) {
        return true;
      }
    }
  }
  return false;
}

std::vector<int> sensors_of(const RoomDescription& room) {
  std::vector<int> sensors;
  for (const CoilPlacement& coil : tracked_coils(room)) {
    sensors.push_back(coil.sensor);
  }
  std::sort(sensors.begin(), sensors.end());
  return sensors;
}

void add(CanTrouble& all, const CanTrouble& one) {
  all.bus_off |= one.bus_off;
  all.restarted |= one.restarted;
  all.passive |= one.passive;
  all.warning |= one.warning;
  all.receive_overflow |= one.receive_overflow;
  all.no_acknowledgement |= one.no_acknowledgement;
  all.protocol_violation |= one.protocol_violation;
}

/// As candump writes it: 3 digits, or 8 of 29 bits.
std::string text_of(std::uint32_t id) {
  const bool is_extended = (id & aurora::kCanExtended) != 0;
  return format(is_extended ? "%08X" : "%03X", id & ~aurora::kCanExtended);
}

/// The gateway whose STATUS `frame` is: check sum and protocol are right, and where it stands in its block.
std::optional<aurora::CanBase> base_by_status(const aurora::CanFrame& frame) {
  const aurora::CanBase base{frame.id & ~(aurora::CanBase::kBlock - 1)};
  const auto status = aurora::unpack_status(frame, base);
  return status && status->coil_count <= aurora::kMaxCanCoils ? std::optional(base) : std::nullopt;
}

void take_other(const aurora::CanFrame& frame, CanHearing& hearing) {
  ++hearing.other_frames;
  auto& ids = hearing.other_ids;
  const auto place = std::lower_bound(ids.begin(), ids.end(), frame.id);
  if ((place == ids.end() || *place != frame.id) && ids.size() < CanHearing::kMaxOtherIds) {
    ids.insert(place, frame.id);
  }
  if (const auto base = base_by_status(frame)) {
    hearing.other_base = base;
  }
}

void take(const aurora::CanFrame& frame, CanHearing& hearing) {
  if (!hearing.base.place_of(frame.id)) {
    take_other(frame, hearing);
    return;
  }
  ++hearing.frames;
  hearing.fd_frames += is_fd_coil(frame.id, hearing.base) ? 1 : 0;
  hearing.classic_frames += is_classic_coil(frame.id, hearing.base) ? 1 : 0;
}

/// "base_id = 0x680", as it stands in the configuration.
std::string setting_of(aurora::CanBase base) {
  return format("base_id = 0x%X", base.number()) + (base.is_extended() ? ", extended_ids = true" : "");
}

Finding other_identifiers(const std::string& where, const CanHearing& hearing) {
  if (hearing.other_base) {
    const aurora::CanBase base = *hearing.other_base;
    return {Verdict::kWrong,
            where + ", but one sends from identifier " + text_of(base.id) + " on, listened for is " +
                text_of(hearing.base.id),
            "set " + setting_of(base) + " in [aurora-can]" +
                (base.is_extended() ? "" : ", extended_ids = false") +
                ", or start the gateway with --base-id" + format(" 0x%X", hearing.base.number()) +
                (hearing.base.is_extended() ? " --extended" : "")};
  }
  std::string heard;
  for (const std::uint32_t id : hearing.other_ids) {
    heard += " " + text_of(id);
  }
  const bool are_all = hearing.other_ids.size() < CanHearing::kMaxOtherIds;
  return {Verdict::kWrong,
          where + format(", but %llu frames of others, identifiers", number(hearing.other_frames)) + heard +
              (are_all ? "" : " ..."),
          "the bus works: start `tubectl can-gateway`, or look whether the gateway is on another bus"};
}

Finding errors_of(const CanHearing& hearing) {
  if (hearing.error_frames == 0) {
    return {Verdict::kGood, "no error frames", ""};
  }
  return {hearing.trouble.bus_off ? Verdict::kWrong : Verdict::kAdvice,
          format("%llu error frames: ", number(hearing.error_frames)) + hearing.name + " " +
              std::string(describe(hearing.trouble)),
          "`ip -details -statistics link show " + hearing.name + "` shows bit rates and error counters"};
}

/// Nothing of a gateway came.
Finding no_gateway(const CanHearing& hearing) {
  const std::string where = "nothing of a gateway at " + hearing.name + format(" in %.0f s", hearing.seconds);
  if (!hearing.gone.empty()) {
    return {Verdict::kWrong, hearing.name + " " + hearing.gone, ""};
  }
  if (hearing.other_frames > 0) {
    return other_identifiers(where, hearing);
  }
  if (hearing.name.find('/') != std::string::npos) {
    return {Verdict::kWrong, where, "one receiver is served at a time: stop tubed, if it is that one"};
  }
  return {Verdict::kWrong, where + ", nor of anybody else",
          "start `tubectl can-gateway`; if it runs: cable, termination, and the same bit rates at both ends"};
}

Finding gateway(const CanHearing& hearing) {
  const std::string layout = hearing.fd_frames > 0 && hearing.classic_frames > 0 ? "both layouts"
                             : hearing.fd_frames > 0                             ? "CAN FD"
                             : hearing.classic_frames > 0                        ? "classic CAN"
                                                                                 : "no coils";
  if (hearing.status && !hearing.status->is_measuring()) {
    return {Verdict::kWrong,
            "the gateway is there, and " + std::string(aurora::describe(hearing.status->tracker_state())),
            ""};
  }
  if (hearing.counts.measurements == 0) {
    const bool bad = hearing.counts.bad_frames > 0;
    return {Verdict::kWrong,
            format("%llu frames of a gateway, but no measurement (%llu frames are not right)",
                   number(hearing.frames), number(hearing.counts.bad_frames)),
            bad ? "is the gateway of another version?"
            : layout == "no coils"
                ? "SYNC comes without coils: the gateway sends CAN FD, the interface here or "
                  "there is classic only? --layout classic, or mtu 72"
                : "coils come without SYNC: two gateways, or most frames are lost"};
  }
  if (!hearing.status) {
    return {Verdict::kAdvice, "measurements in " + layout + ", but no STATUS frame",
            "whether the tracker is an emulated one is not known then: is the gateway of another version?"};
  }
  const bool two = hearing.fd_frames > 0 && hearing.classic_frames > 0;
  const bool simulated = hearing.status->is_simulated();
  return {two ? Verdict::kAdvice : Verdict::kGood,
          layout +
              format(", %d coils, ports present %04X, tracker's status %04X", hearing.status->coil_count,
                     static_cast<unsigned>(hearing.status->ports_present),
                     static_cast<unsigned>(hearing.status->system_status.bits)) +
              (simulated ? ", an emulated tracker" : ""),
          two ? "two gateways on one bus contradict each other: stop one" : ""};
}

/// What the tracker complains of, as it says itself.
Finding tracker(const aurora::SystemStatus& status) {
  std::string found;
  const auto say = [&found](bool is_so, const char* what) {
    found += is_so ? (found.empty() ? "" : ", ") + std::string(what) : "";
  };
  say(status.synchronisation_error(), "synchronisation error");
  say(status.processing_exception(), "processing exception");
  say(status.diagnostic_pending(), "diagnostic message pending");
  say(status.temperature_out_of_range(), "temperature out of range");
  say(status.hardware_changed(), "hardware configuration changed");
  return found.empty() ? Finding{Verdict::kGood, "the tracker reports no trouble", ""}
                       : Finding{Verdict::kAdvice, "the tracker reports: " + found,
                                 "switch it off and on; if that stays, ask its maker"};
}

Finding coils(const CanHearing& hearing, const std::vector<int>& sensors) {
  std::string absent;
  std::string unseen;
  for (const int sensor : sensors) {
    const auto index = static_cast<std::size_t>(sensor - 1);
    const bool is_sent = sensor <= (hearing.status ? hearing.status->coil_count : hearing.newest->coil_count);
    const CoilStatus status =
        is_sent ? aurora::coil_sample(hearing.newest->coils[index]).status : CoilStatus::kDisabled;
    absent += status == CoilStatus::kDisabled ? format(" %d", sensor) : "";
    unseen +=
        status == CoilStatus::kMissing || status == CoilStatus::kOutOfVolume ? format(" %d", sensor) : "";
  }
  if (!absent.empty()) {
    return {Verdict::kWrong, "the gateway has no coil for sensors" + absent,
            "plug it in, or correct --coils of the gateway: its first coil is sensor 1"};
  }
  return unseen.empty()
             ? Finding{Verdict::kGood, "all coils are measured", ""}
             : Finding{Verdict::kAdvice, "no position of sensors" + unseen,
                       "bring the catheter into the measurement volume; try other coils if it stays"};
}

Finding rate(const CanHearing& hearing) {
  const double hz = static_cast<double>(hearing.counts.measurements) / hearing.seconds;
  const std::string found = format(
      "%.1f measurements a second, %llu missed, %llu coils lost, %llu frames damaged", hz,
      number(hearing.counts.missed), number(hearing.counts.lost_coils), number(hearing.counts.bad_frames));
  const bool good = hz > 0.9 * kUsualRateHz &&
                    hearing.counts.lost_coils * 100 <= hearing.counts.measurements &&
                    hearing.counts.bad_frames == 0;
  return good ? Finding{Verdict::kGood, found, ""}
              : Finding{
                    Verdict::kAdvice, found + format("; an Aurora makes %.0f", kUsualRateHz),
                    "look at the load of the bus (`tubectl can-gateway --bus-load`), at who else sends with "
                    "lower identifiers, and at what the gateway says"};
}

}  // namespace

CanHearing listen_to_bus(CanPort& port, int coil_count, std::chrono::nanoseconds time, aurora::CanBase base) {
  CanHearing hearing;
  hearing.name = port.name();
  hearing.seconds = std::chrono::duration<double>(time).count();
  hearing.base = base;
  aurora::CanCoilAssembler assembler(coil_count, base);
  const auto keep = [&hearing](const std::optional<aurora::CanMeasurement>& measurement) {
    hearing.newest = measurement ? measurement : hearing.newest;
  };
  const MonotonicTime end = monotonic_now() + time;
  while (monotonic_now() < end && hearing.gone.empty()) {
    const CanArrival arrival =
        port.read(std::min(end, monotonic_now() + aurora::CanCoilAssembler::kAssemblyTime));
    switch (arrival.kind) {
      case CanArrival::Kind::kFrame:
        take(arrival.frame, hearing);
        keep(assembler.accept(arrival.frame, arrival.received));
        break;
      case CanArrival::Kind::kErrorFrame:
        ++hearing.error_frames;
        add(hearing.trouble, arrival.trouble);
        break;
      case CanArrival::Kind::kUnreadable:
        ++hearing.other_frames;
        break;
      case CanArrival::Kind::kGone:
        hearing.gone = port.describe(arrival.error);
        break;
      case CanArrival::Kind::kNothing:
        keep(assembler.expire(monotonic_now()));
        break;
    }
  }
  hearing.counts = assembler.counts();
  hearing.status = assembler.status();
  return hearing;
}

std::vector<NamedFinding> findings_of(const CanHearing& hearing, const std::vector<int>& sensors) {
  std::vector<NamedFinding> findings{{"bus", errors_of(hearing)}};
  if (hearing.frames == 0) {
    findings.push_back({"gateway", no_gateway(hearing)});
    return findings;
  }
  findings.push_back({"gateway", gateway(hearing)});
  if (hearing.newest) {
    if (hearing.status) {
      findings.push_back({"tracker", tracker(hearing.status->system_status)});
    }
    findings.push_back({"coils", coils(hearing, sensors)});
    findings.push_back({"tracker rate", rate(hearing)});
  }
  return findings;
}

std::vector<NamedFinding> examine_can_port(const Configuration& configuration) {
  if (!is_can(configuration)) {
    return {};
  }
  const std::string& device = configuration.em_source.device;
  const auto port = make_can_port(device, CanUse::kListen);
  const int error = port->open();
  if (error == EAGAIN) {
    return {{"tracker port", {Verdict::kNote, device + " has a receiver, tubed if that runs", ""}}};
  }
  if (error != 0) {
    return {{"tracker port", {Verdict::kWrong, device + " " + std::string(port->describe(error)), ""}}};
  }
  if (is_interface(device) && CanInterface(device, CanUse::kSendFd).open() == EMSGSIZE) {
    return {{"tracker port",
             {Verdict::kNote, device + " is up, for classic frames only",
              "the gateway has to send --layout classic; `ip link set " + device +
                  " type can fd on` (virtual ones: mtu 72) for CAN FD"}}};
  }
  return {{"tracker port",
           {Verdict::kGood, device + (is_interface(device) ? " is up, with CAN FD" : " is there"), ""}}};
}

std::vector<NamedFinding> examine_can_sandbox(const Machine& machine, const Configuration& configuration) {
  if (!is_can(configuration) || !is_interface(configuration.em_source.device) ||
      !std::filesystem::exists(machine.root / "lib/systemd/system/tubed.service")) {
    return {};
  }
  if (some_unit_lets_can_in(machine.root)) {
    return {{"tracker sandbox", {Verdict::kGood, "the service may use CAN", ""}}};
  }
  return {{"tracker sandbox",
           {Verdict::kWrong, "the service may not use CAN: its unit keeps such sockets from it",
            "install /usr/share/tubed/can.conf as its first lines say"}}};
}

std::vector<NamedFinding> examine_can_bus(const Configuration& configuration) {
  if (!is_can(configuration)) {
    return {};
  }
  const auto port = make_can_port(configuration.em_source.device, CanUse::kListen);
  if (const int error = port->open(); error != 0) {
    return {
        {"bus",
         {Verdict::kWrong, configuration.em_source.device + " " + std::string(port->describe(error)), ""}}};
  }
  const int coil_count = std::max(1, aurora::CoilMap(configuration.room).coil_count());
  const aurora::CanBase base = can_base_of(configuration.em_source.settings);
  return findings_of(listen_to_bus(*port, coil_count, kListenedFor, base), sensors_of(configuration.room));
}

}  // namespace tubed
