// tubectl doctor: what this machine lacks for a catheter to be tracked on time, and what to do about it.
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/tubectl/check/doctor_calibrations.hpp"
#include "clients/tubectl/check/doctor_can.hpp"
#include "clients/tubectl/check/doctor_checks.hpp"
#include "clients/tubectl/check/doctor_instruments.hpp"
#include "clients/tubectl/check/doctor_keys.hpp"
#include "clients/tubectl/check/doctor_network.hpp"
#include "clients/tubectl/check/doctor_rivals.hpp"
#include "clients/tubectl/check/doctor_tracker.hpp"
#include "clients/tubectl/check/doctor_video.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"
#include "idl/printable_text.hpp"

namespace tubed {
namespace {

struct DoctorArguments {
  std::string configuration = "/etc/tubed/tubed.toml";
  bool as_json = false;
  bool talk_to_tracker = false;
  std::string trace_folder;
};

/// Several lines may be ours (of a configuration); what else cannot be shown came from a tracker or a
/// process.
std::string shown(std::string_view lines) {
  std::string text;
  while (!lines.empty()) {
    const bool is_line_break = lines.front() == '\n';
    const std::string_view character = take_printable(lines);
    text += is_line_break ? "\n" : character;
  }
  return text;
}

void print(const std::string& name, const Finding& finding) {
  std::string label = std::string(name_of(finding.verdict)) + ":";
  label.resize(8, ' ');
  std::cout << label << shown(name) << ": " << shown(finding.found) << '\n';
  if (!finding.advice.empty()) {
    std::cout << "        " << shown(finding.advice) << '\n';
  }
}

/// On a terminal one line that changes, elsewhere a line each time.
class ProgressLine {
 public:
  void say(const std::string& doing) {
    std::cerr << (is_terminal_ ? "\r\033[K" : "") << printable_text(doing) << (is_terminal_ ? "" : "\n")
              << std::flush;
  }
  void clear() { std::cerr << (is_terminal_ ? "\r\033[K" : "") << std::flush; }

 private:
  bool is_terminal_ = ::isatty(STDERR_FILENO) == 1;
};

/// Nothing when the configuration cannot be read: that is said already.
TrackerExamination look_at_tracker(const DoctorArguments& arguments) {
  try {
    const Configuration configuration = load_configuration(arguments.configuration);
    const PortExamination port = examine_port(configuration);
    TrackerExamination whole{port.findings, ""};
    if (!arguments.talk_to_tracker) {
      return whole;
    }
    const Verdict verdict = port.findings.empty() ? Verdict::kGood : port.findings.front().finding.verdict;
    // A bus can be listened to by many, a serial port is somebody's.
    const bool is_serial = configuration.em_source.driver == "aurora-serial";
    const bool is_free = verdict == Verdict::kGood || (is_serial && verdict == Verdict::kAdvice) ||
                         (!is_serial && verdict == Verdict::kNote);
    if (is_free) {
      ProgressLine progress;
      TrackerExamination tracker = examine_tracker(configuration, port, arguments.trace_folder,
                                                   [&](const std::string& doing) { progress.say(doing); });
      progress.clear();
      std::move(tracker.findings.begin(), tracker.findings.end(), std::back_inserter(whole.findings));
      whole.report = tracker.report;
    } else if (is_serial) {
      whole.report = report_for_help(configuration, port.adapter, nullptr, port.findings);
    }
    return whole;
  } catch (const std::exception&) {
    return {};
  }
}

/// Nothing when the configuration cannot be read.
std::vector<NamedFinding> look_for_rivals(const DoctorArguments& arguments) {
  try {
    return examine_rivals(load_configuration(arguments.configuration));
  } catch (const std::exception&) {
    return {};
  }
}

/// Nothing when the configuration cannot be read.
std::vector<NamedFinding> look_at_sandbox(const Machine& machine) {
  try {
    return examine_can_sandbox(machine, load_configuration(machine.configuration));
  } catch (const std::exception&) {
    return {};
  }
}

/// Nothing when the configuration cannot be read.
std::vector<NamedFinding> look_at_keys(const DoctorArguments& arguments) {
  try {
    return {examine_security(load_configuration(arguments.configuration), std::time(nullptr))};
  } catch (const std::exception&) {
    return {};
  }
}

/// Nothing when the configuration cannot be read.
std::vector<NamedFinding> look_at_room(const DoctorArguments& arguments) {
  try {
    const Configuration configuration = load_configuration(arguments.configuration);
    std::vector<NamedFinding> findings = examine_instruments(configuration);
    const auto calibrations = examine_calibrations(configuration);
    findings.insert(findings.end(), calibrations.begin(), calibrations.end());
    return findings;
  } catch (const std::exception&) {
    return {};
  }
}

/// Of the cameras nothing when the configuration cannot be read.
std::vector<NamedFinding> look_at_images(const Machine& machine) {
  std::vector<NamedFinding> findings = examine_cards(machine, make_linux_video_device);
  try {
    const auto cameras = examine_cameras(load_configuration(machine.configuration), make_linux_video_device);
    findings.insert(findings.end(), cameras.begin(), cameras.end());
  } catch (const std::exception&) {
  }
  return findings;
}

/// Of what runs, and of the defaults when the configuration cannot be read: that is said already.
std::vector<NamedFinding> look_at_network(const Machine& machine) {
  try {
    return examine_network(machine, load_configuration(machine.configuration).dds.network_interface);
  } catch (const std::exception&) {
    return examine_network(machine, DdsSettings{}.network_interface);
  }
}

int run_doctor(const DoctorArguments& arguments) {
  const Machine machine = this_machine(arguments.configuration);
  nlohmann::json report = nlohmann::json::array();
  bool is_wrong = false;
  const auto tell = [&](const std::string& name, const Finding& finding) {
    is_wrong = is_wrong || finding.verdict == Verdict::kWrong;
    if (arguments.as_json) {
      report.push_back({{"check", shown(name)},
                        {"verdict", name_of(finding.verdict)},
                        {"found", shown(finding.found)},
                        {"advice", shown(finding.advice)}});
    } else {
      print(name, finding);
    }
  };
  for (const DoctorCheck& check : doctor_checks()) {
    tell(check.name, check.look(machine));
  }
  for (const NamedFinding& one : look_at_network(machine)) {
    tell(one.name, one.finding);
  }
  for (const NamedFinding& one : look_at_sandbox(machine)) {
    tell(one.name, one.finding);
  }
  for (const NamedFinding& one : look_at_keys(arguments)) {
    tell(one.name, one.finding);
  }
  for (const NamedFinding& one : look_at_room(arguments)) {
    tell(one.name, one.finding);
  }
  for (const NamedFinding& one : look_at_images(machine)) {
    tell(one.name, one.finding);
  }
  const TrackerExamination tracker = look_at_tracker(arguments);
  for (const NamedFinding& one : tracker.findings) {
    tell(one.name, one.finding);
  }
  for (const NamedFinding& one : look_for_rivals(arguments)) {
    tell(one.name, one.finding);
  }
  if (arguments.as_json) {
    if (!tracker.report.empty()) {
      tell("report", {Verdict::kNote, tracker.report, ""});
    }
    std::cout << report.dump(2) << '\n';
  } else if (!tracker.report.empty()) {
    std::cout << "\nCopy this when you ask for help:\n" << shown(tracker.report);
  }
  return is_wrong ? kExitFailed : kExitOk;
}

}  // namespace

CommandLine add_doctor(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<DoctorArguments>();
  CommandLine verb = app.add_subcommand(
      "doctor", "Say what this machine lacks and what to do; exit 1 when something is wrong");
  verb.add_option("-c,--config", arguments->configuration, "The daemon's configuration")
      .capture_default_str();
  Argument tracker = verb.add_flag(
      "--tracker", arguments->talk_to_tracker,
      "Start the configuration's Aurora, measure for 3 s and stop it: firmware, ports, coils, "
      "rate, errors, and a text to copy when you ask for help; not while tubed runs. Behind a CAN "
      "gateway: listen for 3 s");
  verb.add_option("--trace", arguments->trace_folder,
                  "Write what went over the line into this folder: aurora-serial-request.log")
      .needs(tracker);
  verb.add_flag("--json", arguments->as_json, "JSON instead of lines");
  verb.callback([arguments, &exit_code] { exit_code = run_doctor(*arguments); });
  return verb;
}

}  // namespace tubed
