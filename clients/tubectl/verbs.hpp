// The verbs of tubectl, one file each. A verb registers itself; what it does runs when CLI11 has parsed its
// arguments.
#pragma once

#include <CLI/CLI.hpp>

namespace tubed {

// Exit codes, as sysexits.h has them where it has one.
inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;    ///< the work was tried and did not succeed
inline constexpr int kExitUsage = 64;    ///< the command line cannot be understood
inline constexpr int kExitBadData = 65;  ///< a file that was named is not what it should be
inline constexpr int kExitUnavailable =
    69;  ///< something needed is not there: DDS, a daemon, a file to write

// Each returns its subcommand and, when that ran, leaves one of the codes above in `exit_code`, which has to
// outlive `app`. What goes wrong may also be thrown as std::exception: main prints it and exits with
// kExitFailed.
CLI::App* add_demo(CLI::App& app, int& exit_code);
CLI::App* add_simulate(CLI::App& app, int& exit_code);
CLI::App* add_radiograph(CLI::App& app, int& exit_code);
CLI::App* add_aurora_emulator(CLI::App& app, int& exit_code);
CLI::App* add_aurora_record(CLI::App& app, int& exit_code);
CLI::App* add_can_gateway(CLI::App& app, int& exit_code);
CLI::App* add_echo(CLI::App& app, int& exit_code);
CLI::App* add_stat(CLI::App& app, int& exit_code);
CLI::App* add_latency(CLI::App& app, int& exit_code);
CLI::App* add_status(CLI::App& app, int& exit_code);
CLI::App* add_top(CLI::App& app, int& exit_code);
CLI::App* add_doctor(CLI::App& app, int& exit_code);
CLI::App* add_reconstruct(CLI::App& app, int& exit_code);
CLI::App* add_evaluate(CLI::App& app, int& exit_code);
CLI::App* add_explain(CLI::App& app, int& exit_code);
CLI::App* add_grab(CLI::App& app, int& exit_code);
CLI::App* add_configure(CLI::App& app, int& exit_code);

}  // namespace tubed
