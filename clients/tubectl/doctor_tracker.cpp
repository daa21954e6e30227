#include "clients/tubectl/doctor_tracker.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "clients/tubectl/doctor_can.hpp"
#include "drivers/aurora_serial/aurora_serial_source.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kPatience{12};  // a break, RESET, PINIT of all tools, TSTART
constexpr seconds kMeasuredFor{3};
constexpr double kUsualRateHz = 40;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

bool is_aurora(const Configuration& configuration) {
  return configuration.em_source.driver == "aurora-serial";
}

/// Reads until `end`; what open() complained about on the way, newest last.
class Examination {
 public:
  explicit Examination(AuroraSerialSource& source) : source_(source) {}

  /// True as soon as there is a measurement.
  bool wait_for_measurement(MonotonicTime end) {
    while (monotonic_now() < end) {
      if (read_once(end)) {
        return true;
      }
    }
    return false;
  }
  void read_for(std::chrono::nanoseconds time) {
    const MonotonicTime end = monotonic_now() + time;
    while (monotonic_now() < end) {
      measurements_ += read_once(end) ? 1 : 0;
    }
  }
  [[nodiscard]] int measurements() const { return measurements_; }
  [[nodiscard]] const EmFrame& newest() const { return frame_; }
  [[nodiscard]] const std::string& complaint() const { return complaint_; }

 private:
  bool read_once(MonotonicTime end) {
    if (!open_) {
      const OpenResult opened = source_.open();
      open_ = opened.ok;
      complaint_ = opened.ok ? complaint_ : opened.why;
      if (!open_) {
        source_.close();
        return false;
      }
    }
    const ReadOutcome outcome = source_.read(frame_, std::min(end, monotonic_now() + milliseconds(50)));
    if (outcome == ReadOutcome::kLost) {
      source_.close();
      open_ = false;
    }
    return outcome == ReadOutcome::kFrame;
  }

  AuroraSerialSource& source_;
  EmFrame frame_;
  std::string complaint_;
  int measurements_ = 0;
  bool open_ = false;
};

Finding firmware(const aurora::Session& session) {
  const std::string name(session.firmware());
  return {Verdict::kGood,
          (name.empty() ? std::string("the tracker does not say which firmware it has") : name) +
              format(", %d baud", session.baud()),
          ""};
}

Finding coils(const aurora::Session& session) {
  std::string found;
  for (const aurora::FoundCoil& coil : session.found()) {
    const auto index = session.coils().coil_at(coil.plug);
    found += (found.empty() ? "" : ", ") + format("port %d channel %d: ", coil.plug.port, coil.plug.channel) +
             (index ? format("sensor %d", *index + 1) : std::string("not in the configuration")) +
             (coil.usable || coil.error_code == 0 ? "" : format(" (ERROR%02X)", coil.error_code));
  }
  const std::string missing(session.missing().text());
  if (!missing.empty()) {
    return {Verdict::kWrong, missing, "plug it in, or correct port and channel of [[instrument.coil]]"};
  }
  return {Verdict::kGood, found, ""};
}

Finding unseen_coils(const EmFrame& frame, const aurora::CoilMap& map) {
  std::string out;
  for (int i = 0; i < frame.coil_count; ++i) {
    const bool is_ok = frame.coils[static_cast<std::size_t>(i)].status == CoilStatus::kOk;
    out += map.plug(i) && !is_ok ? format(" %d", i + 1) : "";
  }
  return out.empty() ? Finding{Verdict::kGood, "all coils are measured", ""}
                     : Finding{Verdict::kAdvice, "no position of sensors" + out,
                               "bring the catheter into the measurement volume; try other coils if it stays"};
}

Finding rate(int measurements) {
  const double hz = measurements / std::chrono::duration<double>(kMeasuredFor).count();
  const std::string found = format("%.1f measurements a second", hz);
  return hz > 0.9 * kUsualRateHz
             ? Finding{Verdict::kGood, found, ""}
             : Finding{Verdict::kAdvice, found + format(", an Aurora makes %.0f", kUsualRateHz),
                       "raise aurora-serial.baud (8 coils need 230400); look at the errors of the line"};
}

Finding errors(const aurora::PollerCounts& counts, bool uses_text) {
  const std::string found =
      format(
          "%llu questions: %llu without a whole answer, %llu ERRORs, %llu answers refused, %llu "
          "measurements missed",
          static_cast<unsigned long long>(counts.polls), static_cast<unsigned long long>(counts.unanswered),
          static_cast<unsigned long long>(counts.errors), static_cast<unsigned long long>(counts.refused),
          static_cast<unsigned long long>(counts.missed)) +
      (uses_text ? "; BX does not work, TX is used" : "");
  const bool good = counts.unanswered + counts.errors + counts.refused <= counts.polls / 100 && !uses_text;
  return good ? Finding{Verdict::kGood, found, ""}
              : Finding{Verdict::kAdvice, found, "look at cable and adapter; try a lower aurora-serial.baud"};
}

}  // namespace

std::vector<NamedFinding> examine_port(const Configuration& configuration) {
  if (!is_aurora(configuration)) {
    return examine_can_port(configuration);
  }
  SerialPort port(configuration.em_source.device);
  const int error = port.open();
  if (error == 0) {
    return {{"tracker port", {Verdict::kGood, port.path() + " can be opened", ""}}};
  }
  if (error == EBUSY) {
    return {{"tracker port",
             {Verdict::kNote, port.path() + " is in use, by tubed if that runs",
              "stop it before doctor --tracker; while it runs, touch TRACE_FOLDER/"
              "aurora-serial-request has it write what goes over the line"}}};
  }
  return {
      {"tracker port", {Verdict::kWrong, port.path() + " " + std::string(describe_open_error(error)), ""}}};
}

std::vector<NamedFinding> examine_tracker(const Configuration& configuration,
                                          const std::filesystem::path& trace_folder) {
  if (configuration.em_source.driver == "aurora-can") {
    return examine_can_bus(configuration);
  }
  if (!is_aurora(configuration)) {
    return {
        {"tracker",
         {Verdict::kNote,
          "em.driver is \"" + configuration.em_source.driver + "\": nothing to talk to at a port or a bus",
          ""}}};
  }
  AuroraSerialSource source(configuration.room, configuration.em_source.settings,
                            configuration.em_source.device);
  Examination examination(source);
  const bool measures = examination.wait_for_measurement(monotonic_now() + kPatience);
  const aurora::Session& session = source.session();
  std::vector<NamedFinding> findings;
  if (measures) {
    examination.read_for(kMeasuredFor);
    findings = {{"tracker", firmware(session)},
                {"coils", coils(session)},
                {"positions", unseen_coils(examination.newest(), session.coils())},
                {"tracker rate", rate(examination.measurements())},
                {"tracker line", errors(session.poller().counts(), session.poller().uses_text())}};
  } else {
    findings = {{"tracker",
                 {Verdict::kWrong,
                  examination.complaint().empty() ? "no measurement in 12 s" : examination.complaint(),
                  "doctor --tracker --trace FOLDER writes what was said; README of "
                  "drivers/aurora_serial"}}};
  }
  if (!trace_folder.empty()) {
    const bool written = TraceFolder(trace_folder.string(), "aurora-serial")
                             .write_on_request(session.exchange().trace(), "aurora-serial, tubectl doctor");
    findings.push_back({"trace", written ? Finding{Verdict::kGood,
                                                   (trace_folder / "aurora-serial-request.log").string() +
                                                       " has what went over the line",
                                                   ""}
                                         : Finding{Verdict::kAdvice, "no trace could be written",
                                                   "does " + trace_folder.string() + " exist?"}});
  }
  source.close();
  return findings;
}

}  // namespace tubed
