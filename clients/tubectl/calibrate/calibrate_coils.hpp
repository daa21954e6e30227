// The verbs below `tubectl calibrate` that are about the catheter and its coils.
#pragma once

#include "idl/command_line/command_line.hpp"

namespace tubed {

CommandLine add_calibrate_coils(CommandLine app, int& exit_code);
CommandLine add_calibrate_arc_lengths(CommandLine app, int& exit_code);
CommandLine add_calibrate_noise(CommandLine app, int& exit_code);
CommandLine add_calibrate_tip(CommandLine app, int& exit_code);
CommandLine add_calibrate_registration(CommandLine app, int& exit_code);

}  // namespace tubed
