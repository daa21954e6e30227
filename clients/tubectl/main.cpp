// tubectl: what a person types.
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "clients/cpp/limited_log.hpp"
#include "clients/tubectl/verbs.hpp"

namespace {

/// One line a verb: who registers it, under which heading of --help it stands, and how it looks in use.
struct Verb {
  tubed::CommandLine (*add)(tubed::CommandLine app, int& exit_code);
  const char* heading;
  const char* example;
};

const std::vector<Verb> kVerbs{
    {tubed::add_demo, "See it work", "tubectl demo"},
#ifndef TUBED_DEMO_ONLY
#ifdef TUBED_SHOWS_RECORDINGS
    {tubed::add_view, "See it work", "tubectl view field7"},
#endif
    {tubed::add_simulate, "See it work", "tubectl simulate --preset field --seed 7 --out field7"},
    {tubed::add_radiograph, "See it work",
     "tubectl radiograph --lao 60 --clutter wire,leads --out lao60.png"},
    {tubed::add_aurora_emulator, "See it work",
     "tubectl aurora-emulator --play field7 --command 'fault crc 0.01'"},
    {tubed::add_echo, "Watch a daemon", "tubectl echo --json --count 3"},
    {tubed::add_stat, "Watch a daemon", "tubectl stat --seconds 10"},
    {tubed::add_latency, "Watch a daemon", "tubectl latency --seconds 10"},
    {tubed::add_status, "Watch a daemon", "tubectl status"},
    {tubed::add_top, "Watch a daemon", "tubectl top"},
    {tubed::add_record, "Watch a daemon", "tubectl record run-1 --seconds 30"},
#ifdef TUBED_CALIBRATES
    {tubed::add_pivot, "Calibrate a room", "tubectl pivot --live --instrument probe --out tip.toml"},
    {tubed::add_register, "Calibrate a room",
     "tubectl register --markers ct.mrk.json --touched touched.csv --config /etc/tubed/tubed.toml"},
    {tubed::add_calibrate, "Calibrate a room",
     "tubectl calibrate camera image-*.png --phantom phantom.toml --camera A"},
    {tubed::add_geometry, "Calibrate a room", "tubectl geometry xa angiogram.dcm --camera A"},
#endif
    {tubed::add_reconstruct, "Reconstruct and judge",
     "tubectl reconstruct dev1_paper --mode filter --out filter.csv"},
    {tubed::add_evaluate, "Reconstruct and judge",
     "tubectl evaluate dev1_paper --em em.csv --fused filter.csv"},
    {tubed::add_explain, "Reconstruct and judge", "tubectl explain dev1_paper --image 42 --out explained"},
    {tubed::add_check, "Reconstruct and judge", "tubectl check field7"},
    {tubed::add_grab, "Run the daemon", "tubectl grab --video /dev/video0 --socket /run/tubed/image-A.sock"},
    {tubed::add_can_gateway, "Run the daemon", "tubectl can-gateway --serial /dev/tubed/aurora --can can0"},
    {tubed::add_doctor, "Run the daemon", "tubectl doctor"},
    {tubed::add_aurora_record, "Run the daemon",
     "tubectl aurora-record --serial /dev/tubed/aurora --interactive"},
    {tubed::add_configure, "Run the daemon", "tubectl configure dev1_paper --loop > tubed.toml"},
    {tubed::add_keys, "Run the daemon", "tubectl keys make-room keys --room OR-3"},
#endif
};

#ifdef TUBED_DEMO_ONLY
constexpr auto kDescription =
    "Shows a catheter being tracked. This program was built for the demonstration alone; `./run build` makes "
    "all of its verbs, as build/release/bin/tubectl.";
#else
constexpr auto kDescription =
    "Tracks, judges and configures from the command line what tubed sees of a catheter.";
#endif

std::string examples() {
  std::string text = "Examples:\n";
  for (const Verb& verb : kVerbs) text += "  " + std::string(verb.example) + "\n";
  return text +
         "\n`tubectl VERB --help` explains a verb. Exit codes: 0 done, 1 failed, 64 the command line is "
         "wrong, 65 a file is not\n"
         "what it should be, 69 something needed is not available. Research software, not a medical device.";
}

int run(int argc, char** argv) {
  int exit_code = tubed::kExitOk;
  tubed::Program program(kDescription, "tubectl");
  program.set_version("tubectl " TUBED_VERSION);
  tubed::CommandLine app = program.command_line();
  app.help_column(28).require_subcommand();
  for (const Verb& verb : kVerbs) {
    verb.add(app, exit_code).group(verb.heading).footer("Example:\n  " + std::string(verb.example));
  }
  app.footer(examples());  // after the verbs, whose parts would have it, too
  try {
    return program.parse(argc, argv).value_or(exit_code);
  } catch (const std::exception& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return tubed::kExitFailed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    tubed::limit_cyclone_log();
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tubectl: %s\n", error.what());
    return tubed::kExitFailed;
  }
}
