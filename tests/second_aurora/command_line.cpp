#include "tests/second_aurora/command_line.hpp"

#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

CommandLine read_command(std::string_view line) {
  CommandLine command;
  if (line.empty()) {
    command.error = 0x03;
    return command;
  }
  if (line.size() > kLongestLine) {
    command.error = 0x02;
    return command;
  }
  const std::size_t separator = line.find_first_of(": ");
  if (separator == std::string_view::npos) {
    command.error = 0x01;
    return command;
  }
  for (const char letter : line.substr(0, separator)) {
    command.name += letter >= 'a' && letter <= 'z' ? static_cast<char>(letter - 'a' + 'A') : letter;
  }
  std::string_view rest = line.substr(separator + 1);
  if (line[separator] == ':') {
    if (rest.size() < 4 || from_hex(rest.substr(rest.size() - 4)) != crc16(line.substr(0, line.size() - 4))) {
      command.error = 0x04;
      return command;
    }
    rest.remove_suffix(4);
  }
  command.parameters = rest;
  return command;
}

}  // namespace tubed::second_aurora
