// tubectl doctor: what this machine lacks for a catheter to be tracked on time, and what to do about it.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "clients/tubectl/doctor_checks.hpp"
#include "clients/tubectl/doctor_tracker.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"

namespace tubed {
namespace {

struct DoctorArguments {
  std::string configuration = "/etc/tubed/tubed.toml";
  bool as_json = false;
  bool talk_to_tracker = false;
  std::string trace_folder;
};

void print(const std::string& name, const Finding& finding) {
  std::string label = std::string(name_of(finding.verdict)) + ":";
  label.resize(8, ' ');
  std::cout << label << name << ": " << finding.found << '\n';
  if (!finding.advice.empty()) {
    std::cout << "        " << finding.advice << '\n';
  }
}

/// Nothing when the configuration cannot be read: that is said already.
std::vector<NamedFinding> look_at_tracker(const DoctorArguments& arguments) {
  try {
    const Configuration configuration = load_configuration(arguments.configuration);
    std::vector<NamedFinding> findings = examine_port(configuration);
    // A bus can be listened to by many, a serial port is somebody's.
    const bool is_can = configuration.em_source.driver == "aurora-can";
    const bool is_free = findings.empty() || findings.front().finding.verdict == Verdict::kGood ||
                         (is_can && findings.front().finding.verdict == Verdict::kNote);
    if (arguments.talk_to_tracker && is_free) {
      for (NamedFinding& one : examine_tracker(configuration, arguments.trace_folder)) {
        findings.push_back(std::move(one));
      }
    }
    return findings;
  } catch (const std::exception&) {
    return {};
  }
}

int run_doctor(const DoctorArguments& arguments) {
  const Machine machine = this_machine(arguments.configuration);
  nlohmann::json report = nlohmann::json::array();
  bool is_wrong = false;
  const auto tell = [&](const std::string& name, const Finding& finding) {
    is_wrong = is_wrong || finding.verdict == Verdict::kWrong;
    if (arguments.as_json) {
      report.push_back({{"check", name},
                        {"verdict", name_of(finding.verdict)},
                        {"found", finding.found},
                        {"advice", finding.advice}});
    } else {
      print(name, finding);
    }
  };
  for (const DoctorCheck& check : doctor_checks()) {
    tell(check.name, check.look(machine));
  }
  for (const NamedFinding& one : look_at_tracker(arguments)) {
    tell(one.name, one.finding);
  }
  if (arguments.as_json) {
    std::cout << report.dump(2) << '\n';
  }
  return is_wrong ? kExitFailed : kExitOk;
}

}  // namespace

CLI::App* add_doctor(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DoctorArguments>();
  CLI::App* verb = app.add_subcommand(
      "doctor", "Say what this machine lacks and what to do; exit 1 when something is wrong");
  verb->add_option("-c,--config", arguments->configuration, "The daemon's configuration")
      ->capture_default_str();
  CLI::Option* tracker =
      verb->add_flag("--tracker", arguments->talk_to_tracker,
                     "Start the configuration's Aurora, measure for 3 s and stop it: firmware, ports, coils, "
                     "rate, errors; not while tubed runs. Behind a CAN gateway: listen for 3 s");
  verb->add_option("--trace", arguments->trace_folder,
                   "Write what went over the line into this folder: aurora-serial-request.log")
      ->needs(tracker);
  verb->add_flag("--json", arguments->as_json, "JSON instead of lines");
  verb->callback([arguments, &exit_code] { exit_code = run_doctor(*arguments); });
  return verb;
}

}  // namespace tubed
