#include "drivers/laboratory/aurora_emulator/identity.hpp"

#include "drivers/laboratory/aurora_emulator/tool_text.hpp"

namespace tubed::aurora::emulator {

namespace {

constexpr std::string_view kFirmwareVersion = "Features.Firmware.Version";

std::string firmware_text(const Firmware& firmware) {
  return "AURORA Control Firmware\nCopyright: emulated by tubed, no device\nFreeze Tag: " +
         std::string(firmware.freeze_tag) + "\nFreeze Date: none\n";
}

std::string unit_text(const std::string& unit, std::string_view serial) {
  return unit + ", emulated by tubed\nSerial Number: " + std::string(serial) + "\n";
}

std::string field_generator_text() {
  return unit_text("AURORA Field Generator", "A5EF0007") + "Characterization Date: none\n";
}

/// The control unit, and one sensor interface unit for each port with a tool of the settings.
std::string unit_texts(const DeviceSettings& settings) {
  std::string text = unit_text("AURORA System Control Unit", kControlUnitSerial);
  for (const Plug& plug : settings.plugs) {
    text += unit_text("AURORA Sensor Interface Unit " + std::to_string(plug.port),
                      "A5E1" + hex(static_cast<std::uint32_t>(plug.port), 4));
  }
  return text;
}

/// One cube: count, shape, ten fields of a sign and six digits of 0.01 mm (two limits an axis, then four
/// unused), two flags. 500 mm wide, from 50 mm before the field generator on.
constexpr std::string_view kVolumes =
    "19-025000+025000-025000+025000-055000-005000+000000+000000+000000+00000000\n";

}  // namespace

Said version_text(std::string_view parameters, const DeviceSettings& settings) {
  if (parameters.size() != 1 || !parse_hex(parameters)) {
    return {{}, Error::kParameters};
  }
  switch (parameters[0]) {
    case '0':
    case '4':
      return {firmware_text(settings.firmware)};
    case '5':
      return {"013"};
    case '7':
      return {field_generator_text()};
    case '8':
      return {unit_texts(settings)};
    default:
      return {{}, Error::kOutOfRange};
  }
}

Said feature_text(std::string_view parameters) {
  if (parameters == "00") {
    return {"00000000"};
  }
  if (parameters == "03") {
    return {std::string(kVolumes)};
  }
  if (parameters == "10") {
    return {"04"};
  }
  if (parameters == "12") {
    return {"1144"};
  }
  return {{}, parameters.size() == 2 ? Error::kOutOfRange : Error::kParameters};
}

Said user_parameter(std::string_view name, const Firmware& firmware) {
  if (name == "Info.Timeout.PINIT") {
    return {std::string(name) + "=5\n"};
  }
  if (name == kFirmwareVersion && firmware.knows_getinfo) {
    return {std::string(name) + "=" +
            std::string(firmware.freeze_tag.substr(firmware.freeze_tag.size() - 3)) + "\n"};
  }
  return {{}, Error::kNoSuchParameter};
}

Said user_parameter_info(std::string_view name, const Firmware& firmware) {
  return firmware.knows_getinfo ? user_parameter(name, firmware) : Said{{}, Error::kUnknownCommand};
}

}  // namespace tubed::aurora::emulator
