// tubectl configure: a daemon configuration that replays a sequence folder.
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "clients/tubectl/run/replay_configuration.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "idl/settings/key_description.hpp"

namespace tubed {

namespace {

struct ConfigureArguments {
  std::string sequence;
  std::string mode = "filter";
  ReplayConfigurationSettings settings;
  bool loop = false;
  bool em_too = false;
};

void run_configure(const ConfigureArguments& arguments) {
  ReplayConfigurationSettings settings = arguments.settings;
  settings.mode = mode_named(arguments.mode).value_or(EstimatorMode::kJoint);
  settings.replay = arguments.loop ? ReplayLength::kForEver : ReplayLength::kOnce;
  settings.instruments = arguments.em_too ? TrackedTwice::kEmAloneToo : TrackedTwice::kNo;
  std::cout << replay_configuration(read_sequence(arguments.sequence), settings);
}

}  // namespace

CommandLine add_configure(CommandLine app, int& exit_code) {
  CommandLine verb =
      app.add_subcommand("configure", "Write a configuration with which tubed replays a sequence folder");
  const auto arguments = std::make_shared<ConfigureArguments>();
  verb.add_option("SEQUENCE", arguments->sequence, "Sequence folder").required();
  verb.add_flag("--loop", arguments->loop, "Start again at the end, for ever");
  verb.add_option("--domain", arguments->settings.dds_domain, "DDS domain")
      .in_range(0, 230)
      .capture_default_str();
  verb.add_option("--mode", arguments->mode, "Estimator: " + alternatives(mode_names(ModeUse::kRoom)))
      .is_member(mode_names(ModeUse::kRoom))
      .capture_default_str();
  verb.add_flag("--em-too", arguments->em_too,
                "A second instrument, <id>-em, on the same coils with mode = \"em\"");
  verb.callback([arguments, &exit_code] {
    run_configure(*arguments);
    exit_code = kExitOk;
  });
  return verb;
}

}  // namespace tubed
