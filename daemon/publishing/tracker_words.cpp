#include "daemon/publishing/tracker_words.hpp"

#include <array>
#include <cstdio>

namespace tubed {

namespace {

/// As NDI prints it on the tool.
std::string serial_text(std::uint32_t serial_number) {
  std::array<char, 9> digits{};
  std::snprintf(digits.data(), digits.size(), "%08X", serial_number);
  return digits.data();
}

}  // namespace

std::string tracker_words(const TrackerIdentityValues& tracker) {
  std::string words = "tracker is " + (tracker.firmware.empty() ? "of unknown firmware" : tracker.firmware);
  const auto add = [&words](const char* what, const std::string& value) {
    words += value.empty() ? std::string() : std::string(", ") + what + " " + value;
  };
  add("API", tracker.api_revision);
  add("control unit", tracker.control_unit_serial);
  add("field generator", tracker.field_generator);
  if (tracker.tools.empty()) {
    return words + "; no tool has said which it is";
  }
  const char* before = "; tools: ";
  for (const ToolIdentityValues& tool : tracker.tools) {
    words += before + ("port " + std::to_string(tool.port)) + " serial " + serial_text(tool.serial_number);
    words += tool.part_number.empty() ? "" : " part " + tool.part_number;
    before = ", ";
  }
  return words;
}

}  // namespace tubed
