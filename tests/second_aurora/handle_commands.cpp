#include "tests/second_aurora/handle_commands.hpp"

#include <algorithm>

#include "tests/second_aurora/inquiries.hpp"
#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

std::string error_text(int number) { return "ERROR" + hex(static_cast<unsigned>(number), 2); }

Handle* handle_in(PortTable& ports, std::string_view parameters, std::string& wrong) {
  if (parameters.size() < 2) {
    wrong = error_text(0x07);
    return nullptr;
  }
  const auto number = from_hex(parameters.substr(0, 2));
  Handle* handle = number ? ports.find(static_cast<int>(*number)) : nullptr;
  if (handle == nullptr) {
    wrong = error_text(0x08);
  }
  return handle;
}

std::string phrq(const Settings& settings, PortTable& ports, std::string_view parameters) {
  if (parameters.size() != 14) {
    return error_text(0x07);
  }
  const bool any_port = parameters.substr(10, 2) == "**";
  const auto port = any_port ? 0u : from_hex(parameters.substr(10, 2));
  const auto channel = parameters.substr(12, 2) == "**" ? 0u : from_hex(parameters.substr(12, 2));
  if (!port || !channel || *port > settings.ports.size() || (!any_port && *port == 0) || *channel > 1) {
    return error_text(0x23);
  }
  return hex(static_cast<unsigned>(ports.request(static_cast<int>(*port), static_cast<int>(*channel))), 2);
}

std::string phf(PortTable& ports, std::string_view parameters) {
  std::string wrong;
  const Handle* handle = handle_in(ports, parameters, wrong);
  if (handle == nullptr) {
    return wrong;
  }
  ports.free(handle->number);
  ports.allocate_missing();
  return "OKAY";
}

std::string pinit(PortTable& ports, std::string_view parameters) {
  std::string wrong;
  const Handle* handle = handle_in(ports, parameters, wrong);
  if (handle == nullptr) {
    return wrong;
  }
  if (!handle->occupied) {
    return error_text(0x0D);
  }
  const bool partly_written = handle->written_blocks != 0 && !handle->rom_is_written();
  const bool readable =
      handle->tool.rom == Rom::Programmed || (handle->tool.rom == Rom::Blank && handle->rom_is_written());
  if (!handle->initialised && (!readable || partly_written)) {
    return error_text(0x13);
  }
  ports.initialise(*handle);
  return "OKAY";
}

std::string pena(PortTable& ports, std::string_view parameters) {
  std::string wrong;
  Handle* handle = handle_in(ports, parameters, wrong);
  if (handle == nullptr) {
    return wrong;
  }
  if (parameters.size() != 3) {
    return error_text(0x07);
  }
  if (std::string_view("SDBsdb").find(parameters[2]) == std::string_view::npos) {
    return error_text(0x09);
  }
  if (!handle->occupied || !handle->initialised) {
    return error_text(handle->occupied ? 0x0E : 0x0D);
  }
  handle->enabled = true;
  return "OKAY";
}

std::string pdis(PortTable& ports, std::string_view parameters) {
  std::string wrong;
  Handle* handle = handle_in(ports, parameters, wrong);
  if (handle == nullptr) {
    return wrong;
  }
  if (!handle->enabled) {
    return error_text(0x0F);
  }
  handle->enabled = false;
  return "OKAY";
}

std::string phinf(const Settings& settings, PortTable& ports, std::string_view parameters) {
  std::string wrong;
  const Handle* handle = handle_in(ports, parameters, wrong);
  if (handle == nullptr) {
    return wrong;
  }
  const auto options = parameters.size() == 2 ? 0x0001u : from_hex(parameters.substr(2));
  if (!options || (parameters.size() != 2 && parameters.size() != 6)) {
    return error_text(0x07);
  }
  if (*options == 0 || (*options & ~0x003Fu) != 0) {
    return error_text(0x23);
  }
  if (!handle->occupied) {
    return "UNOCCUPIED";
  }
  if (!handle->initialised && !settings.firmware.phinf_before_pinit_is_blank && *options != 0x0020) {
    return error_text(0x0E);
  }
  return handle_information(settings, ports, *handle, *options);
}

std::string pvwr(PortTable& ports, std::string_view parameters) {
  std::string wrong;
  Handle* handle = handle_in(ports, parameters, wrong);
  if (handle == nullptr) {
    return wrong;
  }
  if (parameters.size() != 6 + 2 * kRomBlockBytes) {
    return error_text(0x07);
  }
  const auto address = from_hex(parameters.substr(2, 4));
  if (!address || *address % kRomBlockBytes != 0 || *address >= kRomBytes) {
    return error_text(0x23);
  }
  std::vector<std::uint8_t> block;
  for (std::size_t i = 6; i < parameters.size(); i += 2) {
    const auto byte = from_hex(parameters.substr(i, 2));
    if (!byte) {
      return error_text(0x23);
    }
    block.push_back(static_cast<std::uint8_t>(*byte));
  }
  std::copy(block.begin(), block.end(), handle->written_rom.begin() + static_cast<std::ptrdiff_t>(*address));
  handle->written_blocks =
      static_cast<std::uint16_t>(handle->written_blocks | 1u << (*address / kRomBlockBytes));
  return "OKAY";
}

}  // namespace tubed::second_aurora
