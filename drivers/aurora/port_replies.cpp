#include "drivers/aurora/port_replies.hpp"

#include <algorithm>
#include <charconv>

#include "drivers/aurora/bytes.hpp"
#include "drivers/aurora/command.hpp"

namespace tubed::aurora {

namespace {

constexpr std::string_view kUnoccupied = "UNOCCUPIED";

template <std::size_t N>
FixedText<N> read_text(TextReader& text) noexcept {
  FixedText<N> fixed;
  const std::string_view taken = text.take(N);
  std::copy(taken.begin(), taken.end(), fixed.characters.begin());
  return fixed;
}

ToolDescription read_tool(TextReader& text) noexcept {
  ToolDescription tool;
  tool.kind = static_cast<ToolKind>(text.hex(2));
  tool.switches = static_cast<int>(text.hex(1));
  tool.lights = static_cast<int>(text.hex(1));
  text.take(2);  // reserved
  tool.subtype = static_cast<std::uint8_t>(text.hex(2));
  tool.manufacturer = read_text<12>(text);
  tool.revision = read_text<3>(text);
  tool.serial_number = text.hex(8);
  tool.status.bits = text.hex(2);
  return tool;
}

PortLocation read_location(TextReader& text) noexcept {
  PortLocation location;
  location.control_unit_serial = read_text<8>(text);
  location.system = static_cast<int>(text.hex(1));
  location.tool = static_cast<int>(text.hex(1));
  location.port = static_cast<int>(text.hex(2));
  location.channel = static_cast<int>(text.hex(2));
  return location;
}

std::string_view take_line(std::string_view& text) noexcept {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

std::optional<int> whole_number(std::string_view digits) noexcept {
  int value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, value);
  return error == std::errc{} && stopped == end && value >= 0 ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<HandleList> parse_handle_list(std::string_view payload) noexcept {
  TextReader text(payload);
  const std::uint32_t count = text.hex(2);
  if (text.broken() || count > static_cast<std::uint32_t>(kMaxHandles)) {
    return std::nullopt;
  }
  HandleList list;
  list.count = static_cast<int>(count);
  for (int i = 0; i < list.count; ++i) {
    HandleStatus& entry = list.handles[static_cast<std::size_t>(i)];
    entry.handle = static_cast<std::uint8_t>(text.hex(2));
    entry.status.bits = text.hex(3);
  }
  return text.broken() || text.left() > 0 ? std::nullopt : std::optional(list);
}

std::optional<ToolReply> parse_tool(std::string_view payload, std::uint16_t fields) noexcept {
  ToolReply reply;
  if (payload == kUnoccupied) {
    reply.unoccupied = true;
    return reply;
  }
  TextReader text(payload);
  if ((fields & kToolField) != 0) {
    reply.tool = read_tool(text);
  }
  if ((fields & kPartNumberField) != 0) {
    reply.part_number = read_text<20>(text);
  }
  if ((fields & kLocationField) != 0) {
    reply.location = read_location(text);
  }
  return text.broken() || text.left() > 0 ? std::nullopt : std::optional(reply);
}

std::optional<ApiRevision> parse_api_revision(std::string_view payload) noexcept {
  // D.001.007
  if (payload.size() != 9 || payload[0] < 'A' || payload[0] > 'Z' || payload[1] != '.' || payload[5] != '.') {
    return std::nullopt;
  }
  const auto major = whole_number(payload.substr(2, 3));
  const auto minor = whole_number(payload.substr(6, 3));
  if (!major || !minor) {
    return std::nullopt;
  }
  return ApiRevision{payload[0], *major, *minor};
}

std::optional<std::string_view> find_firmware(std::string_view payload) noexcept {
  constexpr std::string_view kTag = "Freeze Tag:";
  while (!payload.empty()) {
    std::string_view line = take_line(payload);
    const std::size_t tag = line.find(kTag);
    if (tag == std::string_view::npos) {
      continue;
    }
    line.remove_prefix(tag + kTag.size());
    const std::size_t first = line.find_first_not_of(' ');
    if (first != std::string_view::npos) {
      return line.substr(first, line.find_last_not_of(' ') - first + 1);
    }
  }
  return std::nullopt;
}

std::optional<std::string_view> find_serial_number(std::string_view payload) noexcept {
  constexpr std::string_view kNames[] = {"serial", "Serial", "SERIAL", "S/N"};
  while (!payload.empty()) {
    std::string_view line = take_line(payload);
    const bool speaks_of_it = std::any_of(std::begin(kNames), std::end(kNames), [&](std::string_view name) {
      return line.find(name) != std::string_view::npos;
    });
    if (!speaks_of_it) {
      continue;
    }
    const std::size_t colon = line.find(':');
    line.remove_prefix(colon == std::string_view::npos ? 0 : colon + 1);
    const std::size_t first = line.find_first_not_of(' ');
    if (first != std::string_view::npos) {
      return line.substr(first, line.find_last_not_of(" \r") - first + 1);
    }
  }
  return std::nullopt;
}

std::optional<std::string_view> find_user_parameter(std::string_view payload,
                                                    std::string_view name) noexcept {
  while (!payload.empty()) {
    const std::string_view line = take_line(payload);
    if (line.size() > name.size() && line.substr(0, name.size()) == name && line[name.size()] == '=') {
      return line.substr(name.size() + 1);
    }
  }
  return std::nullopt;
}

}  // namespace tubed::aurora
