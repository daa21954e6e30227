#include "drivers/laboratory/aurora_emulator/tool_text.hpp"

#include <array>

#include "drivers/aurora/port_replies.hpp"
#include "drivers/laboratory/aurora_emulator/identity.hpp"

namespace tubed::aurora::emulator {

namespace {

std::string padded(std::string_view text, std::size_t size) {
  std::string whole(text.substr(0, size));
  whole.resize(size, ' ');
  return whole;
}

/// 33 characters: kind, switches, lights, reserved, subtype, manufacturer, revision, serial number, status.
std::string description(const PortHandle& handle, const Plug& plug) {
  const bool known = handle.initialised;
  return std::string(known ? "0B00" : "0000") + "00" + (known ? "01" : "00") +
         padded(known ? kSimulatedManufacturer : "", 12) + (known ? "001" : "000") +
         hex(known ? plug.serial_number : 0, 8) + hex(handle.status().bits & 0xFF, 2);
}

}  // namespace

std::string hex(std::uint32_t value, int digits) {
  std::array<std::uint8_t, 8> room{};
  ByteWriter writer(room);
  writer.hex(value, digits);
  return std::string(as_text(writer.written()));
}

std::string handle_list_text(const std::vector<PortHandle>& handles) {
  std::string text = hex(static_cast<std::uint32_t>(handles.size()), 2);
  for (const PortHandle& handle : handles) {
    text += hex(handle.number, 2) + hex(handle.status().bits & 0xFFF, 3);
  }
  return text;
}

std::string tool_text(const PortHandle& handle, const Plug& plug, std::uint32_t fields) {
  if (handle.stale) {
    return "UNOCCUPIED";
  }
  std::string text;
  text += (fields & 0x0001) != 0 ? description(handle, plug) : "";
  text += (fields & 0x0002) != 0 ? "00000000" : "";
  text += (fields & 0x0004) != 0 ? padded(handle.initialised ? plug.part_number : "", 20) : "";
  text += (fields & 0x0008) != 0 ? "00" : "";
  text += (fields & 0x0010) != 0 ? "00" : "";
  if ((fields & 0x0020) != 0) {
    text += std::string(kControlUnitSerial) + "00" + hex(static_cast<std::uint32_t>(plug.port), 2) +
            hex(static_cast<std::uint32_t>(handle.channel), 2);
  }
  return text;
}

}  // namespace tubed::aurora::emulator
