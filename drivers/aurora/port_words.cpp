#include "drivers/aurora/port_words.hpp"

#include <array>

#include "drivers/aurora/error_codes.hpp"

namespace tubed::aurora {

namespace {

enum class Cause { kTracked, kFailed, kOtherTool, kPulled, kNoCoil, kNoTool };

/// Why a coil of the map is not tracked, and what was found at its plug.
struct Absence {
  Cause cause = Cause::kNoTool;
  const FoundCoil* found = nullptr;
};

bool is_tracked(const FoundCoil& coil) noexcept { return coil.usable && !coil.other_tool; }

Absence absence_of(CoilPlug plug, std::span<const FoundCoil> found, const FoundSet& pulled) noexcept {
  Absence absence;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const FoundCoil& coil = found[i];
    if (coil.plug.port != plug.port || coil.unoccupied) {
      continue;
    }
    // Of a tool that cannot be initialised only the first coil is known.
    const bool same = coil.plug == plug || (coil.error_code != 0 && !coil.usable);
    if (!same) {
      absence = absence.cause == Cause::kNoTool ? Absence{Cause::kNoCoil, &coil} : absence;
      continue;
    }
    if (pulled.test(i)) {
      absence = {Cause::kPulled, &coil};
    } else if (is_tracked(coil)) {
      return {Cause::kTracked, &coil};
    } else if (coil.other_tool) {
      return {Cause::kOtherTool, &coil};
    } else {
      return {Cause::kFailed, &coil};
    }
  }
  return absence;
}

void name_tool(Problem& words, const FoundCoil& coil) noexcept {
  (words << "tool ").hex(coil.serial_number, 8);
  if (!coil.part_number.empty()) {
    words << " (part " << coil.part_number.text() << ")";
  }
}

void name_expected(Problem& words, const ExpectedTool& tool) noexcept {
  if (tool.serial_number) {
    (words << "tool ").hex(*tool.serial_number, 8);
  }
  if (!tool.part_number.empty()) {
    words << (tool.serial_number ? " (part " : "part ") << tool.part_number.text()
          << (tool.serial_number ? ")" : "");
  }
}

void describe(Problem& words, CoilPlug plug, const Absence& absence, const ExpectedTool& expected) noexcept {
  words << "port " << plug.port;
  switch (absence.cause) {
    case Cause::kFailed:
      if (absence.found->error_code == 0) {
        words << ": the tracker did not answer for it";
        break;
      }
      (words << ": ERROR").hex(absence.found->error_code);
      words << ", " << describe_error(absence.found->error_code).meaning;
      break;
    case Cause::kOtherTool:
      words << ": ";
      name_tool(words, *absence.found);
      words << " is plugged in, ";
      name_expected(words, expected);
      words << " is configured";
      break;
    case Cause::kPulled:
      words << ": the tool was unplugged";
      break;
    case Cause::kNoCoil:
      words << ": the tool has no channel " << plug.channel;
      break;
    case Cause::kNoTool:
    case Cause::kTracked:
      words << ": no tool";
      break;
  }
}

}  // namespace

Problem describe_missing(const CoilMap& map, std::span<const FoundCoil> found,
                         const FoundSet& pulled) noexcept {
  Problem words;
  std::bitset<kMaxTrackerCoils> told;
  for (int index = 0; index < map.coil_count(); ++index) {
    const auto plug = map.plug(index);
    const Absence absence = plug ? absence_of(*plug, found, pulled) : Absence{Cause::kTracked, nullptr};
    if (absence.cause == Cause::kTracked || told.test(static_cast<std::size_t>(index))) {
      continue;
    }
    describe(words << (words.empty() ? "" : "; "), *plug, absence, map.expected(index));
    words << "; sensor " << index + 1;
    for (int other = index + 1; other < map.coil_count(); ++other) {
      const auto beside = map.plug(other);
      if (beside && beside->port == plug->port && absence_of(*beside, found, pulled).cause == absence.cause) {
        words << ", " << other + 1;
        told.set(static_cast<std::size_t>(other));
      }
    }
    words << " left out";
  }
  return words;
}

Problem describe_unused(const CoilMap& map, std::span<const FoundCoil> found) noexcept {
  Problem words;
  for (const FoundCoil& coil : found) {
    if (coil.plug.port != 0 && !coil.unoccupied && !map.coil_at(coil.plug)) {
      words << (words.empty() ? "not in the configuration, not tracked: port " : ", port ") << coil.plug.port
            << " channel " << coil.plug.channel;
      if (coil.error_code != 0) {
        (words << " (ERROR").hex(coil.error_code) << ")";
      }
    }
  }
  return words;
}

Problem describe_system_status(SystemStatus status) noexcept {
  Problem words;
  const auto say = [&words](bool is_so, std::string_view what) {
    if (is_so) {
      words << (words.empty() ? "" : "; ") << what;
    }
  };
  say(status.hardware_changed(),
      "the field generator or other hardware was unplugged or changed: check its cable");
  say(status.temperature_out_of_range(),
      "the tracker's temperature is out of range: its accuracy suffers; let it warm up, clear its vents");
  say(status.synchronisation_error(), "the tracker has lost synchronisation: check the cables of its units");
  say(status.diagnostic_pending(),
      "the tracker has a diagnostic message pending: NDI's own program shows it");
  say(status.processing_exception(), "the tracker reports a recoverable processing exception");
  return words;
}

}  // namespace tubed::aurora
