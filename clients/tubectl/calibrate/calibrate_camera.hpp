// The verbs below `tubectl calibrate` that are about cameras and their clocks.
#pragma once

#include "idl/command_line/command_line.hpp"

namespace tubed {

CommandLine add_calibrate_camera(CommandLine app, int& exit_code);
CommandLine add_calibrate_phantom(CommandLine app, int& exit_code);
CommandLine add_calibrate_time(CommandLine app, int& exit_code);
CommandLine add_calibrate_view(CommandLine app, int& exit_code);

}  // namespace tubed
