// The commands that work on port handles: each takes its parameters and returns the payload of its reply.
#pragma once

#include <string>
#include <string_view>

#include "tests/second_aurora/port_table.hpp"
#include "tests/second_aurora/settings.hpp"

namespace tubed::second_aurora {

// `ERRORnn`.
std::string error_text(int number);
// Nullptr, and the ERROR in `wrong`, unless the first two characters name an allocated handle.
Handle* handle_in(PortTable& ports, std::string_view parameters, std::string& wrong);

std::string phrq(const Settings& settings, PortTable& ports, std::string_view parameters);
std::string phf(PortTable& ports, std::string_view parameters);
std::string pinit(PortTable& ports, std::string_view parameters);
std::string pena(PortTable& ports, std::string_view parameters);
std::string pdis(PortTable& ports, std::string_view parameters);
std::string phinf(const Settings& settings, PortTable& ports, std::string_view parameters);
std::string pvwr(PortTable& ports, std::string_view parameters);

}  // namespace tubed::second_aurora
