// tubectl doctor: what this machine lacks for a catheter to be tracked on time, and what to do about it.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/tubectl/doctor_checks.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {
namespace {

struct DoctorArguments {
  std::string configuration = "/etc/tubed/tubed.toml";
  bool as_json = false;
};

void print(const char* name, const Finding& finding) {
  std::string label = std::string(name_of(finding.verdict)) + ":";
  label.resize(8, ' ');
  std::cout << label << name << ": " << finding.found << '\n';
  if (!finding.advice.empty()) {
    std::cout << "        " << finding.advice << '\n';
  }
}

int run_doctor(const DoctorArguments& arguments) {
  const Machine machine = this_machine(arguments.configuration);
  nlohmann::json report = nlohmann::json::array();
  bool is_wrong = false;
  for (const DoctorCheck& check : doctor_checks()) {
    const Finding finding = check.look(machine);
    is_wrong = is_wrong || finding.verdict == Verdict::kWrong;
    if (arguments.as_json) {
      report.push_back({{"check", check.name},
                        {"verdict", name_of(finding.verdict)},
                        {"found", finding.found},
                        {"advice", finding.advice}});
    } else {
      print(check.name, finding);
    }
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
  verb->add_flag("--json", arguments->as_json, "JSON instead of lines");
  verb->callback([arguments, &exit_code] { exit_code = run_doctor(*arguments); });
  return verb;
}

}  // namespace tubed
