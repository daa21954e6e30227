// The verbs of tubectl, one file each. A verb registers itself; what it does runs when the command line has
// been parsed.
#pragma once

#include "idl/command_line/command_line.hpp"

namespace tubed {

// Exit codes, as sysexits.h has them where it has one.
inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;    ///< the work was tried and did not succeed
inline constexpr int kExitUsage = 64;    ///< the command line cannot be understood
inline constexpr int kExitBadData = 65;  ///< a file that was named is not what it should be
inline constexpr int kExitUnavailable =
    69;  ///< something needed is not there: DDS, a daemon, a file to write

// Each returns its subcommand and, when that ran, leaves one of the codes above in `exit_code`, which has to
// outlive the command line. What goes wrong may also be thrown as std::exception: main prints it and exits
// with kExitFailed.
CommandLine add_demo(CommandLine app, int& exit_code);
CommandLine add_view(CommandLine app, int& exit_code);
CommandLine add_simulate(CommandLine app, int& exit_code);
CommandLine add_radiograph(CommandLine app, int& exit_code);
CommandLine add_aurora_emulator(CommandLine app, int& exit_code);
CommandLine add_aurora_record(CommandLine app, int& exit_code);
CommandLine add_can_gateway(CommandLine app, int& exit_code);
CommandLine add_echo(CommandLine app, int& exit_code);
CommandLine add_stat(CommandLine app, int& exit_code);
CommandLine add_latency(CommandLine app, int& exit_code);
CommandLine add_status(CommandLine app, int& exit_code);
CommandLine add_top(CommandLine app, int& exit_code);
CommandLine add_doctor(CommandLine app, int& exit_code);
CommandLine add_check(CommandLine app, int& exit_code);
CommandLine add_reconstruct(CommandLine app, int& exit_code);
CommandLine add_evaluate(CommandLine app, int& exit_code);
CommandLine add_explain(CommandLine app, int& exit_code);
CommandLine add_record(CommandLine app, int& exit_code);
CommandLine add_grab(CommandLine app, int& exit_code);
CommandLine add_configure(CommandLine app, int& exit_code);
CommandLine add_keys(CommandLine app, int& exit_code);
CommandLine add_pivot(CommandLine app, int& exit_code);
CommandLine add_register(CommandLine app, int& exit_code);
CommandLine add_calibrate(CommandLine app, int& exit_code);
CommandLine add_geometry(CommandLine app, int& exit_code);

}  // namespace tubed
