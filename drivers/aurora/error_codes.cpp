#include "drivers/aurora/error_codes.hpp"

#include <algorithm>
#include <array>
#include <iterator>

namespace tubed::aurora {

namespace {

struct Row {
  std::uint8_t code;
  ErrorDescription description;
};

using enum Remedy;

constexpr Row kErrors[] = {
    {0x01, {"invalid command", kReport}},
    {0x02, {"command too long", kReport}},
    {0x03, {"command too short", kReport}},
    {0x04, {"check sum of the command is wrong", kCheckLink}},
    {0x05, {"time-out while the command was carried out", kRetry}},
    {0x06, {"communication parameters refused", kReport}},
    {0x07, {"wrong number of parameters", kReport}},
    {0x08, {"invalid port handle", kReport}},
    {0x09, {"invalid tracking mode (priority)", kReport}},
    {0x0A, {"invalid LED", kReport}},
    {0x0B, {"invalid LED state", kReport}},
    {0x0C, {"command not allowed in the present mode", kReinitialise}},
    {0x0D, {"no tool behind the port handle", kReport}},
    {0x0E, {"port handle not initialised", kReport}},
    {0x0F, {"port handle not enabled", kReport}},
    {0x10, {"system not initialised", kReinitialise}},
    {0x11, {"cannot stop tracking", kReport}},
    {0x12, {"cannot start tracking", kReport}},
    {0x13,
     {"cannot initialise the port handle: the tool's memory is unreadable or unprogrammed", kGiveUpTool}},
    {0x14, {"field generator: invalid parameters or incompatible hardware", kReport}},
    {0x15, {"cannot initialise the system", kReport}},
    {0x16, {"diagnostics cannot be started", kReport}},
    {0x17, {"diagnostics cannot be stopped", kReport}},
    {0x19, {"wrong firmware version", kReport}},
    {0x1A, {"internal error of the tracker", kRetry}},
    {0x1D, {"search for the tool's memory failed", kReport}},
    {0x1E, {"reading the tool's memory failed", kReport}},
    {0x1F, {"writing the tool's memory failed", kReport}},
    {0x20, {"selecting the tool's memory failed", kReport}},
    {0x21, {"current test of the tool failed", kReport}},
    {0x22, {"no such volume or wavelength", kReport}},
    {0x23, {"parameter out of range", kReport}},
    {0x24, {"volume cannot be selected", kReport}},
    {0x25, {"feature list not available", kReport}},
    {0x28, {"too many tools", kReport}},
    {0x29, {"firmware is corrupt", kReport}},
    {0x2A, {"tracker has no memory left", kReport}},
    {0x2B, {"port handle not allocated", kReinitialise}},
    {0x2C, {"port handle became unoccupied", kReinitialise}},
    {0x2D, {"all port handles are in use", kReport}},
    {0x2E, {"incompatible firmware", kReport}},
    {0x2F, {"port description missing or wrong", kReport}},
    {0x30, {"port already assigned", kReport}},
    {0x31, {"input or output state refused", kReport}},
    {0x32, {"operation not valid for this device", kReport}},
    {0x33, {"feature not available", kReport}},
    {0x34, {"no such user parameter", kReport}},
    {0x35, {"user parameter: wrong type of value", kReport}},
    {0x36, {"user parameter: value out of range", kReport}},
    {0x37, {"user parameter: index out of range", kReport}},
    {0x38, {"user parameter: wrong size", kReport}},
    {0x39, {"permission denied", kReport}},
    {0x3B, {"file not found", kReport}},
    {0x3C, {"file cannot be written", kReport}},
    {0x3D, {"file cannot be read", kReport}},
    {0x40, {"tool definition file is wrong", kReport}},
    {0x41, {"tool characteristics not supported", kReport}},
    {0x42, {"device not present", kReport}},
    {0xF1, {"too much infrared light around", kReport}},
    {0xF4, {"flash memory cannot be erased", kReport}},
    {0xF5, {"flash memory cannot be written", kReport}},
    {0xF6, {"flash memory cannot be read", kReport}},
};

constexpr bool by_code(const Row& row, std::uint8_t code) { return row.code < code; }
static_assert(std::is_sorted(std::begin(kErrors), std::end(kErrors),
                             [](const Row& a, const Row& b) { return a.code < b.code; }));

}  // namespace

ErrorDescription describe_error(std::uint8_t code) noexcept {
  const auto* const row = std::lower_bound(std::begin(kErrors), std::end(kErrors), code, by_code);
  const bool known = row != std::end(kErrors) && row->code == code;
  return known ? row->description : ErrorDescription{"unknown error", kReport};
}

std::string_view remedy_text(Remedy remedy) noexcept {
  switch (remedy) {
    case kRetry:
      return "send it again";
    case kReinitialise:
      return "initialise again";
    case kGiveUpTool:
      return "go on without this tool";
    case kCheckLink:
      return "check cable and baud rate";
    case kReport:
      break;
  }
  return "tell a person";
}

}  // namespace tubed::aurora
