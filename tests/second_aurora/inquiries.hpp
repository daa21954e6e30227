// Answers that tell about the device and change nothing: VER, SFLIST, GETINFO, GET, PHINF.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tests/second_aurora/port_table.hpp"
#include "tests/second_aurora/settings.hpp"

namespace tubed::second_aurora {

// Each returns the payload; empty where the device has no such thing.
std::optional<std::string> version_text(const Firmware& firmware, std::string_view option);
std::optional<std::string> feature_text(std::string_view option);
// `Features.Firmware.Version` and the time-outs `Info.Timeout.*`.
std::optional<std::string> user_parameter(const Firmware& firmware, std::string_view name);
// Options 0001 to 0020 and their sums. Before PINIT the fields are blank and zero.
std::string handle_information(const Settings& settings, const PortTable& ports, const Handle& handle,
                               std::uint32_t options);

}  // namespace tubed::second_aurora
