// The buttons of a demonstration.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "clients/view/messages.hpp"

namespace tubed {

/// What can be broken in a simulated room with these cameras, and made whole again. Images are those of all
/// cameras.
std::vector<DemoCommand> demo_commands(const std::vector<std::string>& cameras);

/// What {"press": NAME} asks for: one of `commands`, or nullptr for whatever else a page says.
const DemoCommand* pressed_command(std::string_view words, const std::vector<DemoCommand>& commands);

/// Sends a command to the control sockets of the simulation in that folder (`control_folder` of its
/// configuration). False when a source does not take it.
bool send_command(const DemoCommand& command, const std::filesystem::path& folder);

}  // namespace tubed
