#include "clients/tubectl/check/doctor_tracker.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>

#include "clients/tubectl/check/doctor_can.hpp"
#include "clients/tubectl/check/tracker_findings.hpp"
#include "clients/tubectl/check/tracker_startup.hpp"
#include "drivers/aurora_serial/aurora_serial_source.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kBetweenProgress{100};
constexpr seconds kMaxLook{2};  // for other programs at the port
constexpr seconds kMeasuredFor{3};

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

bool is_aurora(const Configuration& configuration) {
  return configuration.em_source.driver == "aurora-serial";
}

/// Reads until `end`; keeps what the source said last while it did not measure.
class Examination {
 public:
  explicit Examination(AuroraSerialSource& source) : source_(source) {}

  /// True as soon as there is a measurement. Waits as long as the tracker may need for what is plugged in.
  bool wait_for_measurement(const std::function<void(const std::string&)>& on_progress) {
    const MonotonicTime began = monotonic_now();
    std::string told;
    for (MonotonicTime now = began; now < end_; now = monotonic_now()) {
      if (read_once(now + kBetweenProgress)) {
        return true;
      }
      const TrackerStartup startup = read_startup(source_.session().exchange().trace());
      end_ = startup.deadline(began);
      if (startup.doing != told) {
        told = startup.doing;
        on_progress(told);
      }
    }
    waited_s_ = static_cast<int>(std::chrono::duration_cast<seconds>(monotonic_now() - began).count());
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
  [[nodiscard]] int waited_s() const { return waited_s_; }

 private:
  bool read_once(MonotonicTime end) {
    if (outcome_ == ReadOutcome::kNothing) {
      source_.wait(std::min(end, monotonic_now() + milliseconds(50)));
    }
    outcome_ = source_.read(frame_);
    const SourceCondition condition = source_.condition();  // after each read: words may last no longer
    if (outcome_ == ReadOutcome::kFrame) {
      return true;
    }
    if (condition.state != DeviceState::kRunning && !condition.words.empty()) {
      complaint_ = condition.words.text();
    }
    return false;
  }

  AuroraSerialSource& source_;
  EmFrame frame_;
  ReadOutcome outcome_ = ReadOutcome::kNothing;
  std::string complaint_;
  int measurements_ = 0;
  int waited_s_ = 0;
  MonotonicTime end_ = MonotonicTime::max();  ///< of waiting for a measurement
};

Finding in_use(SerialPort& port) {
  const std::string words(port.explain(EBUSY, kMaxLook).text());
  if (words.find(" tubed (process") != std::string::npos ||
      words.find("another program") != std::string::npos) {
    return {Verdict::kNote, words,
            "stop tubed, if it is that, before doctor --tracker; while it runs, touch TRACE_FOLDER/"
            "aurora-serial-request has it write what goes over the line"};
  }
  return {Verdict::kWrong, words, ""};
}

Finding opened(const SerialPort& port) {
  const PortHolder& other = port.other_program();
  if (other.process == 0) {
    return {Verdict::kGood, port.path() + " can be opened", ""};
  }
  return {Verdict::kAdvice,
          port.path() + " can be opened, but " + std::string(other.program.text()) +
              format(" (process %d) has it open as well: each takes bytes from the other", other.process),
          "close that program"};
}

/// Also of a port that somebody else has.
AdapterFacts adapter_at(const std::string& path) {
  struct stat port {};
  if (::stat(path.c_str(), &port) != 0) {
    return {};
  }
  const SystemPlaces places;
  return {true, std::string(device_name(places, port.st_rdev).text()), usb_identity(places, port.st_rdev),
          latency_timer_ms(places, port.st_rdev)};
}

Finding no_measurement(const Examination& examination, const aurora::Session& session) {
  const TrackerStartup startup = read_startup(session.exchange().trace());
  std::string found = format("no measurement in %d s", examination.waited_s());
  found += startup.doing.empty() ? "" : "; the last that was said: " + startup.doing;
  found += startup.errors.empty() ? "" : "; answered with " + startup.error_text();
  return {Verdict::kWrong, examination.complaint().empty() ? found : examination.complaint() + "; " + found,
          "doctor --tracker --trace FOLDER writes what was said; README of drivers/aurora_serial"};
}

Finding written_trace(const std::filesystem::path& folder, const aurora::Session& session) {
  const bool written = TraceFolder(folder.string(), "aurora-serial")
                           .write_on_request(session.exchange().trace(), "aurora-serial, tubectl doctor");
  return written
             ? Finding{Verdict::kGood,
                       (folder / "aurora-serial-request.log").string() + " has what went over the line", ""}
             : Finding{Verdict::kAdvice, "no trace could be written", "does " + folder.string() + " exist?"};
}

}  // namespace

PortExamination examine_port(const Configuration& configuration) {
  if (!is_aurora(configuration)) {
    return {examine_can_port(configuration), {}};
  }
  SerialPort port(configuration.em_source.device);
  const int error = port.open();
  port.look_around(kMaxLook);
  PortExamination result{{}, adapter_at(port.path())};
  if (error == 0) {
    result.findings = {{"tracker port", opened(port)}, {"tracker adapter", adapter_finding(result.adapter)}};
  } else if (error == EBUSY) {
    result.findings = {{"tracker port", in_use(port)}};
  } else {
    result.findings = {{"tracker port", {Verdict::kWrong, std::string(port.explain(error).text()), ""}}};
  }
  return result;
}

TrackerExamination examine_tracker(const Configuration& configuration, const PortExamination& port,
                                   const std::filesystem::path& trace_folder,
                                   const std::function<void(const std::string&)>& on_progress) {
  if (configuration.em_source.driver == "aurora-can") {
    return {examine_can_bus(configuration), ""};
  }
  if (!is_aurora(configuration)) {
    return {
        {{"tracker",
          {Verdict::kNote,
           "em.driver is \"" + configuration.em_source.driver + "\": nothing to talk to at a port or a bus",
           ""}}},
        ""};
  }
  // The daemon's own traces are not written over.
  AuroraSerialSource source(configuration.room,
                            configuration.em_source.settings.with("trace_folder", std::string()),
                            configuration.em_source.device);
  Examination examination(source);
  const aurora::Session& session = source.session();
  TrackerExamination result;
  if (examination.wait_for_measurement(on_progress)) {
    on_progress(format("measuring for %d s", static_cast<int>(kMeasuredFor.count())));
    examination.read_for(kMeasuredFor);
    result.findings =
        findings_of_tracking(session, {examination.newest(), examination.measurements(), kMeasuredFor},
                             port.adapter, configuration.em_source.settings.get<std::string>("baud"));
  } else {
    result.findings = {{"tracker", no_measurement(examination, session)}};
    if (!session.found().empty()) {
      result.findings.push_back({"tracker handles", handle_finding(session)});
    }
  }
  if (!trace_folder.empty()) {
    result.findings.push_back({"trace", written_trace(trace_folder, session)});
  }
  std::vector<NamedFinding> all = port.findings;
  all.insert(all.end(), result.findings.begin(), result.findings.end());
  result.report = report_for_help(configuration, port.adapter, &session, all);
  source.close();
  return result;
}

}  // namespace tubed
