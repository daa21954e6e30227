#include "clients/tubectl/check/tracker_findings.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>

#include "drivers/aurora_serial/port_surroundings.hpp"

namespace tubed {

namespace {

constexpr double kUsualRateHz = 40;
constexpr std::uint8_t kToolNotReadable = 0x13;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

Finding firmware(const aurora::Session& session, const std::string& wanted_baud) {
  const std::string name(session.firmware());
  std::string found =
      name.empty() ? std::string("the tracker does not say which firmware it has") : "firmware " + name;
  if (const auto& revision = session.api_revision()) {
    found += format(", API %c.%03d.%03d", revision->family, revision->major, revision->minor);
  }
  found += format(", %d baud", session.baud());
  if (std::to_string(session.baud()) == wanted_baud) {
    return {Verdict::kGood, found, ""};
  }
  return {Verdict::kAdvice, found + " instead of " + wanted_baud + ", which tracker or port have not",
          "5 coils need 115200 baud, 8 coils 230400: ask NDI for newer firmware, or use the USB port of the "
          "System Control Unit"};
}

bool is_tracked(const aurora::FoundCoil& coil, const aurora::CoilMap& map) {
  return coil.usable && map.coil_at(coil.plug).has_value();
}

Finding coils(const aurora::Session& session) {
  const std::string missing(session.missing().text());
  if (!missing.empty()) {
    const bool is_blank = std::any_of(session.found().begin(), session.found().end(),
                                      [](const auto& coil) { return coil.error_code == kToolNotReadable; });
    return {Verdict::kWrong, missing,
            is_blank ? "the memory of a tool with ERROR13 is empty or cannot be read: clean its plug, or put "
                       "its definition into aurora-serial.tool_folder as port-N.rom"
                     : "plug it in, or correct port and channel of [[instrument.coil]]"};
  }
  std::vector<aurora::FoundCoil> in_order(session.found().begin(), session.found().end());
  std::sort(in_order.begin(), in_order.end(), [](const auto& a, const auto& b) { return a.plug < b.plug; });
  std::string found;
  for (const aurora::FoundCoil& coil : in_order) {
    const auto index = session.coils().coil_at(coil.plug);
    found += (found.empty() ? "" : ", ") + format("port %d channel %d: ", coil.plug.port, coil.plug.channel) +
             (index ? format("sensor %d", *index + 1) : std::string("not in the configuration"));
  }
  return {Verdict::kGood, found, ""};
}

Finding unseen_coils(const EmFrame& frame, const aurora::Session& session) {
  std::string out;
  for (const aurora::FoundCoil& coil : session.found()) {
    if (is_tracked(coil, session.coils())) {
      const int index = *session.coils().coil_at(coil.plug);
      const bool is_ok = frame.coils[static_cast<std::size_t>(index)].status == CoilStatus::kOk;
      out += is_ok ? "" : format(" %d", index + 1);
    }
  }
  return out.empty() ? Finding{Verdict::kGood, "all coils that are plugged in are measured", ""}
                     : Finding{Verdict::kAdvice, "no position of sensors" + out,
                               "bring the catheter into the measurement volume; try other coils if it stays"};
}

/// Measurements a second for which the line has room: command and BX reply, and what the adapter waits.
double room_hz(int coils, int baud, int latency_timer_ms) {
  constexpr int kBitsPerByte = 10;
  constexpr int kCommandBytes = 12;
  constexpr int kReplyBytes = 11;
  constexpr int kBytesPerCoil = 42;
  const double line_s = double{kBitsPerByte} * (kCommandBytes + kReplyBytes + kBytesPerCoil * coils) / baud;
  return 1 / (line_s + 1e-3 * (latency_timer_ms > 1 ? latency_timer_ms : 0));
}

Finding rate(const TrackerMeasurements& measured, const aurora::Session& session,
             const AdapterFacts& adapter) {
  const double hz = measured.count / std::chrono::duration<double>(measured.time).count();
  const std::string found = format("%.1f measurements a second", hz);
  if (hz > 0.9 * kUsualRateHz) {
    return {Verdict::kGood, found, ""};
  }
  const auto tracked = static_cast<int>(
      std::count_if(session.found().begin(), session.found().end(),
                    [&](const aurora::FoundCoil& coil) { return is_tracked(coil, session.coils()); }));
  const double line_hz = room_hz(tracked, session.baud(), 0);
  const double adapter_hz = room_hz(tracked, session.baud(), adapter.latency_timer_ms.value_or(0));
  std::string advice = "look at the errors of the line, and at what else this machine does";
  if (line_hz < kUsualRateHz && hz > 0.8 * line_hz) {
    advice = format(
        "at %d baud the line has room for %.0f with %d coils: raise aurora-serial.baud (8 need 230400)",
        session.baud(), line_hz, tracked);
  } else if (adapter_hz < 0.9 * line_hz && hz > 0.8 * adapter_hz) {
    advice = "the adapter's latency timer allows no more: see tracker adapter";
  }
  return {Verdict::kAdvice, found + format(", an Aurora makes %.0f", kUsualRateHz), advice};
}

Finding errors(const aurora::Session& session) {
  const aurora::PollerCounts& counts = session.poller().counts();
  const std::string found = format(
      "%llu questions: %llu without a whole answer, %llu ERRORs, %llu answers refused, %llu "
      "measurements missed",
      static_cast<unsigned long long>(counts.polls), static_cast<unsigned long long>(counts.unanswered),
      static_cast<unsigned long long>(counts.errors), static_cast<unsigned long long>(counts.refused),
      static_cast<unsigned long long>(counts.missed));
  if (counts.unanswered + counts.refused > counts.polls / 100) {
    return {Verdict::kAdvice, found, "bytes are damaged or lost: try another cable, adapter or USB port"};
  }
  return counts.errors <= counts.polls / 100
             ? Finding{Verdict::kGood, found, ""}
             : Finding{Verdict::kAdvice, found,
                       "the tracker answers with " + read_startup(session.exchange().trace()).error_text() +
                           ": the line is in order; --trace FOLDER shows what was asked"};
}

}  // namespace

Finding adapter_finding(const AdapterFacts& adapter) {
  const int late_ms = adapter.latency_timer_ms.value_or(0);
  const std::string found = adapter_text(adapter);
  const std::string words(describe_latency_timer(late_ms, adapter.device_name).text());
  return words.empty() ? Finding{Verdict::kGood, found, ""} : Finding{Verdict::kAdvice, found, words};
}

Finding handle_finding(const aurora::Session& session) {
  const aurora::ReportedHandles& handles = session.poller().handles();
  std::string others;
  std::set<std::uint32_t> tools;
  for (const aurora::FoundCoil& coil : session.found()) {
    const bool is_enabled = is_tracked(coil, session.coils());
    others += is_enabled ? "" : "; " + handle_text(coil, session.coils());
    if (coil.serial_number != 0) {
      tools.insert(coil.serial_number);
    }
  }
  std::string found = format("%zu allocated, %zu enabled, %zu in the replies; tools", session.found().size(),
                             handles.tracked().size(), handles.reported().size());
  for (const std::uint32_t serial_number : tools) {
    found += format(" %08X", serial_number);
  }
  return {others.empty() ? Verdict::kGood : Verdict::kNote, found + others, ""};
}

Finding reply_finding(ReplyForm form, const aurora::PollerCounts& counts, const TrackerStartup& startup) {
  if (form == ReplyForm::kBinary) {
    return {Verdict::kGood, "BX, binary", ""};
  }
  const bool is_refused = std::any_of(startup.errors.begin(), startup.errors.end(),
                                      [](const auto& entry) { return entry.first.first == "BX"; });
  const std::string why = is_refused ? "the tracker refuses BX: " + startup.error_text()
                                     : format("no whole BX reply has come; %llu questions were in vain",
                                              static_cast<unsigned long long>(counts.unanswered));
  return {Verdict::kAdvice, "TX, text, because " + why,
          "TX is 1.6 times as long and coarser: with more than 3 coils set aurora-serial.baud to 230400; ask "
          "NDI for newer firmware when it refuses BX"};
}

std::vector<NamedFinding> findings_of_tracking(const aurora::Session& session,
                                               const TrackerMeasurements& measured,
                                               const AdapterFacts& adapter, const std::string& wanted_baud) {
  const ReplyForm form = session.poller().encoding().uses_text() ? ReplyForm::kText : ReplyForm::kBinary;
  return {{"tracker", firmware(session, wanted_baud)},
          {"tracker handles", handle_finding(session)},
          {"coils", coils(session)},
          {"positions", unseen_coils(measured.newest, session)},
          {"tracker rate", rate(measured, session, adapter)},
          {"tracker replies",
           reply_finding(form, session.poller().counts(), read_startup(session.exchange().trace()))},
          {"tracker line", errors(session)}};
}

}  // namespace tubed
