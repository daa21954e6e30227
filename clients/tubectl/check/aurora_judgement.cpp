#include "clients/tubectl/check/aurora_judgement.hpp"

#include <array>
#include <cstdio>

#include "drivers/aurora/wire_log.hpp"

namespace tubed {

namespace {

std::string_view name_of(aurora::Report report) {
  switch (report) {
    case aurora::Report::kValid:
      return "pose";
    case aurora::Report::kMissing:
      return "MISSING";
    case aurora::Report::kDisabled:
      return "DISABLED";
    case aurora::Report::kUnoccupied:
      return "UNOCCUPIED";
    case aurora::Report::kImplausible:
      return "impossible pose";
  }
  return "unknown";
}

}  // namespace

std::string_view name_of(AssumptionVerdict verdict) {
  switch (verdict) {
    case AssumptionVerdict::kHolds:
      return "holds";
    case AssumptionVerdict::kDoesNotHold:
      return "does not hold";
    case AssumptionVerdict::kNotTried:
      return "not tried";
  }
  return "unknown";
}

std::string quoted(std::string_view bytes, std::size_t max_size) {
  aurora::WireLog log;
  log.entries.push_back({{}, aurora::WireEvent::kNote, {}, 0, std::string(bytes.substr(0, max_size))});
  std::string text = aurora::format_wire_log(log);
  constexpr std::string_view kNote = " note ";
  text.erase(0, text.find(kNote) + kNote.size());
  text.pop_back();
  if (text.size() > max_size || bytes.size() > max_size) {
    text = text.substr(0, max_size) + "...";
  }
  return text;
}

std::string quoted(const WireMeasurement& measurement) {
  constexpr std::size_t kMaxShownHandles = 4;
  std::string text;
  for (std::size_t i = 0; i < measurement.readings.size() && i < kMaxShownHandles; ++i) {
    const aurora::HandleReading& reading = measurement.readings[i];
    const bool has_frame =
        reading.report != aurora::Report::kDisabled && reading.report != aurora::Report::kUnoccupied;
    text += hex(reading.handle, 2) + " " + std::string(name_of(reading.report)) +
            (has_frame ? " " + hex(reading.frame, 8) : "") + ", ";
  }
  const bool is_cut = measurement.readings.size() > kMaxShownHandles;
  return (is_cut ? text + "..., " : text) + "status " + hex(measurement.system_status.bits, 4);
}

std::string quoted(const WireTurn& turn) {
  const std::string command = "> " + tubed::quoted(turn.line) + " < ";
  if (turn.measurement) {
    return command + quoted(*turn.measurement);
  }
  if (turn.reply) {
    return command + tubed::quoted(turn.reply->payload);
  }
  return command + (turn.damaged ? "(damaged reply)" : "(no reply)");
}

std::string hex(std::uint32_t value, int digits) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%0*X", digits, value);
  return text.data();
}

std::string with_unit(double value, int digits, std::string_view unit) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*f ", digits, value);
  return text.data() + std::string(unit);
}

double seconds_of(std::chrono::nanoseconds time) { return std::chrono::duration<double>(time).count(); }

Judgement not_tried(std::string_view what_would_try_it) {
  return {AssumptionVerdict::kNotTried, std::nullopt, std::string(what_would_try_it)};
}

Judgement judged(AssumptionVerdict verdict, std::chrono::nanoseconds time, std::string evidence) {
  return {verdict, time, std::move(evidence)};
}

}  // namespace tubed
