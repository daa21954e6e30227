#include "clients/tubectl/check/tracker_report.hpp"

#include <sys/utsname.h>

#include <array>
#include <cstdio>

#include "clients/tubectl/check/tracker_startup.hpp"

namespace tubed {

namespace {

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

std::string kernel() {
  utsname system{};
  return ::uname(&system) == 0 ? std::string(system.sysname) + " " + system.release + " " + system.machine
                               : "unknown kernel";
}

std::string tracker_text(const aurora::Session& session) {
  const std::string firmware(session.firmware());
  std::string text = firmware.empty() ? "firmware not said" : firmware;
  if (const auto& revision = session.api_revision()) {
    text += format(", API %c.%03d.%03d", revision->family, revision->major, revision->minor);
  }
  text += format(", %d baud", session.baud());
  return text + (session.poller().encoding().uses_text() ? ", TX" : ", BX");
}

std::string counts_text(const aurora::PollerCounts& counts) {
  return format(
      "polls %llu measurements %llu missed %llu unanswered %llu errors %llu refused %llu",
      static_cast<unsigned long long>(counts.polls), static_cast<unsigned long long>(counts.measurements),
      static_cast<unsigned long long>(counts.missed), static_cast<unsigned long long>(counts.unanswered),
      static_cast<unsigned long long>(counts.errors), static_cast<unsigned long long>(counts.refused));
}

std::string session_text(const aurora::Session& session) {
  const TrackerStartup startup = read_startup(session.exchange().trace());
  std::string text;
  if (startup.answered_at) {
    text += "tracker: " + tracker_text(session) + "\n";
    for (const aurora::FoundCoil& coil : session.found()) {
      text += handle_text(coil, session.coils()) + "\n";
    }
    text += counts_text(session.poller().counts()) + "\n";
  }
  text += "last said: " + (startup.doing.empty() ? std::string("nothing") : startup.doing) + "\n";
  return text + (startup.errors.empty() ? "" : "errors: " + startup.error_text() + "\n");
}

/// The path of a port may contain a user's name: /home/somebody/tty.
std::string without_folders(std::string text, const std::string& path) {
  for (std::size_t at = 0; !path.empty() && (at = text.find(path, at)) != std::string::npos;) {
    const std::string name(last_component(path));
    text.replace(at, path.size(), name);
    at += name.size();
  }
  return text;
}

}  // namespace

std::string adapter_text(const AdapterFacts& adapter) {
  if (!adapter.identity) {
    return adapter.is_there ? "no USB adapter" : "not there";
  }
  return std::string(describe(*adapter.identity).text()) +
         (adapter.latency_timer_ms ? format(", latency timer %d ms", *adapter.latency_timer_ms)
                                   : ", no latency timer");
}

std::string handle_text(const aurora::FoundCoil& coil, const aurora::CoilMap& map) {
  const auto index = map.coil_at(coil.plug);
  std::string text = format("handle %02X port %d channel %d", coil.handle, coil.plug.port, coil.plug.channel);
  text += coil.serial_number != 0 ? format(" serial number %08X", coil.serial_number) : "";
  text += index ? format(" sensor %d", *index + 1) : " not in the configuration";
  if (coil.error_code != 0) {
    return text + format(", not usable: ERROR%02X", coil.error_code);
  }
  return coil.usable ? text : text + ", not usable";
}

std::string report_for_help(const Configuration& configuration, const AdapterFacts& adapter,
                            const aurora::Session* session, const std::vector<NamedFinding>& findings) {
  const std::string& device = configuration.em_source.device;
  std::string text = "tubed " TUBED_VERSION ", " + kernel() + "\nport " +
                     std::string(last_component(device)) + ": " + adapter_text(adapter) + ", baud " +
                     configuration.em_source.settings.get<std::string>("baud") + " asked for\n";
  text += session == nullptr ? "" : session_text(*session);
  for (const NamedFinding& one : findings) {
    if (one.finding.verdict != Verdict::kGood && one.name != "tracker handles") {
      text += std::string(name_of(one.finding.verdict)) + ": " + one.name + ": " + one.finding.found + "\n";
    }
  }
  return without_folders(text, device);
}

}  // namespace tubed
