#include "tests/second_aurora/inquiries.hpp"

#include <utility>

#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

namespace {

std::string padded(std::string text, std::size_t width) {
  text.resize(width, ' ');
  return text;
}

constexpr const char* kCopyright = "(C) Northern Digital Inc.\n";

}  // namespace

std::optional<std::string> version_text(const Firmware& firmware, std::string_view option) {
  if (option == "0" || option == "4") {
    return "Aurora Control Firmware\nNDI S/N: A5-01234\nCharacterization Date: 01/15/06\nFreeze Tag: " +
           firmware.freeze_tag + "\nFreeze Date: 03/02/06\n" + kCopyright;
  }
  if (option == "5") {
    return firmware.combined_revision;
  }
  if (option == "7") {
    return std::string(
               "Aurora Field Generator\nNDI S/N: F3-00421\nCharacterization Date: 02/20/06\n"
               "Freeze Tag: AURORA FG Rev 002\nFreeze Date: 11/30/05\n") +
           kCopyright;
  }
  if (option == "8") {
    return std::string(
               "Aurora Sensor Interface Unit\nNDI S/N: S1-00077\nFreeze Tag: AURORA SIU Rev 003\n"
               "NDI S/N: S2-00078\nFreeze Tag: AURORA SIU Rev 003\n") +
           kCopyright;
  }
  return std::nullopt;
}

std::optional<std::string> feature_text(std::string_view option) {
  if (option == "00") {
    return "00000003";
  }
  if (option == "03") {
    // One volume: a cube, ten dimensions in 0.01 mm, a reserved character and whether it resists metal.
    return "19-025000+025000-025000+025000-055000-005000+000000+000000+000000+00000000\n";
  }
  if (option == "10") {
    return "04";
  }
  if (option == "12") {
    return "1144";
  }
  return std::nullopt;
}

std::optional<std::string> user_parameter(const Firmware& firmware, std::string_view name) {
  static constexpr std::pair<std::string_view, std::string_view> kParameters[] = {
      {"Info.Timeout.INIT", "5"},   {"Info.Timeout.PINIT", "5"}, {"Info.Timeout.TSTART", "8"},
      {"Info.Timeout.TSTOP", "3"},  {"Info.Timeout.TX", "3"},    {"Info.Timeout.BX", "3"},
      {"Info.Timeout.RESET", "15"}, {"Info.Timeout.COMM", "2"},  {"Info.Timeout.PVWR", "3"},
  };
  if (name == "Features.Firmware.Version") {
    return std::string(name) + "=" + firmware.freeze_tag.substr(firmware.freeze_tag.find_last_of(' ') + 1) +
           "\n";
  }
  for (const auto& [known, value] : kParameters) {
    if (name == known) {
      return std::string(name) + "=" + std::string(value) + "\n";
    }
  }
  return std::nullopt;
}

std::string handle_information(const Settings& settings, const PortTable& ports, const Handle& handle,
                               std::uint32_t options) {
  const bool known = handle.initialised;
  std::string text;
  if ((options & 0x0001) != 0) {
    const std::string maker = !handle.tool.manufacturer.empty() ? handle.tool.manufacturer
                              : settings.simulated_maker        ? "TUBED SIM"
                                                                : "NDI";
    text += known ? hex(static_cast<unsigned>(handle.tool.main_type), 2) + "000000" + padded(maker, 12) +
                        "001" + hex(handle.tool.serial, 8)
                  : "00000000" + padded("", 12) + "00000000000";
    text += hex(static_cast<unsigned>(ports.status_of(handle)), 2);
  }
  if ((options & 0x0002) != 0) {
    text += "00000000";
  }
  if ((options & 0x0004) != 0) {
    text += padded(known ? handle.tool.part_number : "", 20);
  }
  if ((options & 0x0008) != 0) {
    text += "00";
  }
  if ((options & 0x0010) != 0) {
    text += "00";
  }
  if ((options & 0x0020) != 0) {
    text += "A501234000" + hex(static_cast<unsigned>(handle.port), 2) +
            hex(static_cast<unsigned>(handle.channel), 2);
  }
  return text;
}

}  // namespace tubed::second_aurora
