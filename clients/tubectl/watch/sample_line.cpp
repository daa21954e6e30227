#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "clients/cpp/centreline.hpp"
#include "clients/tubectl/watch/sample_text.hpp"
#include "idl/printable_text.hpp"
#include "idl/validity.hpp"

namespace tubed {
namespace {

/// Seconds since 1970 to the millisecond: sorts, subtracts, and has no time zone.
double seconds(std::int64_t time_ns) { return static_cast<double>(time_ns) / 1e9; }

constexpr std::array<const char*, 6> kStageStates{"starting",     "running", "degraded",
                                                  "reconnecting", "ended",   "failed"};

const char* state_name(std::uint32_t state) {
  return state < kStageStates.size() ? kStageStates[state] : "unknown";
}

std::string latency_text(const tubed_TubeEstimate& estimate, std::int64_t received_monotonic_ns) {
  const std::int64_t measured_ns = measured_monotonic_ns(estimate);
  if (measured_ns == 0) {
    return "nothing measured";
  }
  // As doubles: whatever the sample states, this does not overflow.
  const double milliseconds =
      (static_cast<double>(received_monotonic_ns) - static_cast<double>(measured_ns)) / 1e6;
  return fmt::format("{:.1f} ms since {}", milliseconds, estimate.has_image ? "exposure" : "EM");
}

// As EmSamples.idl counts them.
const char* coil_status(std::uint32_t status) {
  constexpr std::array<const char*, 4> kWords{"missing", "no pose", "out of volume", "disabled"};
  return status < kWords.size() ? kWords[status] : "unknown status";
}

std::string registration_text(float residual_mm) {
  return std::isfinite(residual_mm) ? fmt::format("residual {:.2f} mm", residual_mm)
                                    : std::string("residual not stated");
}

// Nothing of what the tracker did not say.
std::string tracker_text(const tubed_TrackerIdentity& tracker) {
  if (tracker.firmware[0] == '\0' && tracker.control_unit_serial[0] == '\0' && tracker.tool_count == 0) {
    return " | the tracker has not said which it is";
  }
  std::string text = fmt::format(" | tracker {}", printable_text(tracker.firmware));
  const auto add = [&text](const char* what, const char* words) {
    text += words[0] == '\0' ? "" : fmt::format(", {} {}", what, printable_text(words));
  };
  add("API", tracker.api_revision);
  add("control unit", tracker.control_unit_serial);
  add("field generator", tracker.field_generator);
  const std::size_t count = std::min<std::size_t>(tracker.tool_count, std::size(tracker.tools));
  for (std::size_t i = 0; i < count; ++i) {
    const tubed_ToolIdentity& tool = tracker.tools[i];
    text += fmt::format(", port {} serial {:08X}", tool.port, tool.serial_number);
    add("part", tool.part_number);
  }
  return text;
}

}  // namespace

std::string age_text(std::int64_t age_ns) {
  const double seconds = static_cast<double>(age_ns) * 1e-9;
  if (age_ns < 0) return "never";
  if (seconds < 0.25) return fmt::format("{:.0f}ms", seconds * 1e3);
  return seconds < 120 ? fmt::format("{:.1f}s", seconds) : fmt::format("{:.0f}min", seconds / 60);
}

std::int64_t measured_monotonic_ns(const tubed_TubeEstimate& estimate) {
  return estimate.has_image ? estimate.stamps.exposure_monotonic_ns
                            : estimate.stamps.em_measured_monotonic_ns;
}

namespace {

// Where it is not the whole tube that something holds.
std::string unheld_text(const tubed_TubeEstimate& estimate) {
  const double percent = 100 * unheld_ratio(estimate);
  return percent > 0 ? fmt::format(", nothing holds {:.0f} %", std::max(percent, 1.0)) : std::string();
}

}  // namespace

std::string line_of(const tubed_TubeEstimate& estimate, std::int64_t received_monotonic_ns) {
  const Vector3 tip = point_at(estimate, 0);
  const bool has_shape = std::isfinite(tip[0]) && std::isfinite(tip[1]) && std::isfinite(tip[2]);
  const std::string shape = has_shape
                                ? fmt::format("tip {:.2f} {:.2f} {:.2f} mm sigma {:.2f} mm{}", tip[0], tip[1],
                                              tip[2], sigma_mm_at(estimate, 0), unheld_text(estimate))
                                : std::string("no shape");
  return fmt::format("{:.3f} {} #{} {} {} {}, {}", seconds(estimate.valid_time_ns),
                     printable_text(estimate.instrument_id), estimate.sequence_number,
                     name_of(static_cast<Validity>(estimate.validity)), names_of(Reasons(estimate.reasons)),
                     shape, latency_text(estimate, received_monotonic_ns));
}

std::string line_of(const tubed_EmSamples& samples) {
  std::string line =
      fmt::format("{:.3f} {} #{} tracker frame {}", seconds(samples.measured_ns),
                  printable_text(samples.instrument_id), samples.sequence_number, samples.tracker_frame);
  const std::size_t count = std::min<std::size_t>(samples.coil_count, std::size(samples.coils));
  for (std::size_t i = 0; i < count; ++i) {
    const tubed_EmCoil& coil = samples.coils[i];
    line += std::isfinite(coil.p_em_mm[0])
                ? fmt::format(" | {:.2f} {:.2f} {:.2f}", coil.p_em_mm[0], coil.p_em_mm[1], coil.p_em_mm[2])
                : std::string(" | ") + coil_status(coil.status);
  }
  return line;
}

std::string line_of(const tubed_TubeStatus& status) {
  std::string line =
      fmt::format("{:.3f} {} {} {}, newest estimate: {}", seconds(status.time_ns),
                  printable_text(status.instrument_id), name_of(static_cast<Validity>(status.validity)),
                  names_of(Reasons(status.reasons)), age_text(status.estimate_age_ns));
  const std::size_t count = std::min<std::size_t>(status.stage_count, std::size(status.stages));
  for (std::size_t i = 0; i < count; ++i) {
    const tubed_StageStatus& stage = status.stages[i];
    line += fmt::format(" | {} {}{}{}", printable_text(stage.name), state_name(stage.state),
                        stage.why[0] == '\0' ? "" : ": ", printable_text(stage.why));
  }
  return line;
}

std::string line_of(const tubed_TubeIdentity& identity) {
  return fmt::format(
      "{} tubed {} mode {} {:.2f} x {:.0f} mm, {} coils, {} cameras, world = {}, axes {}, registration "
      "{}{}",
      printable_text(identity.instrument_id), printable_text(identity.software_version),
      printable_text(identity.mode), identity.diameter_mm, identity.length_mm, identity.coil_count,
      identity.camera_count, printable_text(identity.world_frame), printable_text(identity.world_axes),
      registration_text(identity.registration_residual_mm), tracker_text(identity.tracker));
}

std::string line_of(const tubed_TubeHealth& health) {
  std::string line = fmt::format("{:.3f} {} {} estimates", seconds(health.time_ns),
                                 printable_text(health.instrument_id), health.estimates);
  if (health.agreement.probability > 0) {
    line += fmt::format(" | coils and images {}, as stated {:.0f} %",
                        health.agreement.disagree ? "disagree" : "agree", 100 * health.agreement.as_stated);
  }
  const std::size_t count = std::min<std::size_t>(health.stage_count, std::size(health.stages));
  for (std::size_t i = 0; i < count; ++i) {
    const tubed_StageHealth& stage = health.stages[i];
    line += fmt::format(" | {} {} steps, {} dropped, max {:.1f} ms", printable_text(stage.name), stage.steps,
                        stage.dropped, static_cast<double>(stage.busy.max_ns) / 1e6);
  }
  return line;
}

}  // namespace tubed
