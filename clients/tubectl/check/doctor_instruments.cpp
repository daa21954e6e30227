#include "clients/tubectl/check/doctor_instruments.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/coils/loose_ends.hpp"
#include "daemon/estimator/tip/rest_hook.hpp"

namespace tubed {

namespace {

constexpr double kNegligible_mm = 2;    // of a stretch
constexpr double kNearestCoil_mm = 2;   // from the tip to a coil's middle: it is some millimetres long
constexpr double kSeesAnyHook_mm = 11;  // from the tip: a coil there contradicts the smallest that is tried

struct Stretch {
  double from_mm;
  double to_mm;
};

/// What no coil is near to, tip first. Precondition: at least one coil, in the order of their arc lengths.
std::vector<Stretch> unheld_stretches(const InstrumentDescription& instrument) {
  constexpr double kHolds_mm = CoilObservations::kHolds_mm;
  std::vector<Stretch> stretches;
  double held_until_mm = 0;
  const auto add = [&](double from_mm, double to_mm) {
    if (to_mm - from_mm > kNegligible_mm) stretches.push_back({from_mm, to_mm});
  };
  for (const CoilPlacement& coil : instrument.coils) {
    add(held_until_mm, coil.offset_from_tip_mm - kHolds_mm);
    held_until_mm = std::max(held_until_mm, coil.offset_from_tip_mm + kHolds_mm);
  }
  add(held_until_mm, instrument.length_mm);
  return stretches;
}

std::string words_of(const std::vector<Stretch>& stretches) {
  std::string words;
  for (const Stretch& stretch : stretches) {
    words += fmt::format("{}{:.0f} to {:.0f} mm", words.empty() ? "" : ", ", stretch.from_mm, stretch.to_mm);
  }
  return words;
}

/// What helps a hook in which no coil lies far enough inside.
std::string where_to_mount(double inside_mm, const char* or_views) {
  if (inside_mm >= kNearestCoil_mm) {
    return fmt::format("mount a coil {:.0f} mm from the tip or nearer{}", inside_mm, or_views);
  }
  return fmt::format(
      "no coil can be mounted far enough inside so short a hook: mount one as near to the tip as the "
      "catheter "
      "allows, which helps{}; otherwise the tip is not believed (TIP_NOT_SEEN or AMBIGUOUS)",
      or_views);
}

Finding tip_of(const InstrumentDescription& instrument, double first_mm, std::size_t cameras) {
  const double hook_mm = instrument.rest_curve().length_mm();
  const double inside_mm = hook_mm - RestHook::kInside_mm;
  const Verdict verdict = cameras > 1 ? Verdict::kNote : Verdict::kAdvice;
  const char* const or_views = cameras > 0 ? ", or use two views at least 10 degrees apart" : "";
  if (is_preshaped(instrument.rest_shape) && first_mm > inside_mm) {
    return {verdict,
            fmt::format("its tip is a hook of {:.0f} mm and the first coil lies {:.0f} mm from the tip: one "
                        "view cannot tell to which side the hook turns (AMBIGUOUS)",
                        hook_mm, first_mm),
            where_to_mount(inside_mm, or_views)};
  }
  if (instrument.rest_shape == RestShape::kUnknown && cameras > 0 && first_mm > kSeesAnyHook_mm &&
      first_mm <= CoilObservations::kHolds_mm) {
    return {Verdict::kNote,
            fmt::format("the first coil lies {:.0f} mm from the tip and rest_shape is not stated: it is "
                        "AMBIGUOUS at times whether the tip is a hook",
                        first_mm),
            "say rest_shape in the configuration"};
  }
  if (first_mm > CoilObservations::kHolds_mm) {
    return {
        verdict,
        fmt::format("the first coil lies {:.0f} mm from the tip: {}", first_mm,
                    cameras > 0 ? "out of view nothing holds the tip, and one view does not tell whether it "
                                  "turns toward the camera or away"
                                : "nothing holds the tip"),
        fmt::format("mount a coil within {:.0f} mm of the tip{}", CoilObservations::kHolds_mm, or_views)};
  }
  return {};
}

/// A hook that is configured where no hook is solved for.
Finding hook_taken_straight(EstimatorMode mode) {
  const bool is_mode = mode == EstimatorMode::kEm || mode == EstimatorMode::kPaper;
  return {Verdict::kAdvice,
          is_mode ? fmt::format("a bent tip is configured, and mode \"{}\" takes every tip for straight: "
                                "TIP_NOT_SEEN always",
                                name_of(mode))
                  : "a bent tip is configured, and without a camera every tip is taken for straight: "
                    "TIP_NOT_SEEN always",
          is_mode ? "set mode = \"filter\"" : "configure a camera"};
}

NamedFinding examine(const InstrumentDescription& instrument, EstimatorMode mode, std::size_t room_cameras) {
  const std::string name = "coils of " + instrument.id;
  if (instrument.coils.empty()) {
    return {name, {}};
  }
  const std::size_t cameras = mode == EstimatorMode::kEm ? 0 : room_cameras;
  if (is_preshaped(instrument.rest_shape) && (cameras == 0 || mode == EstimatorMode::kPaper)) {
    return {name, hook_taken_straight(mode)};
  }
  const std::vector<Stretch> stretches = unheld_stretches(instrument);
  Finding tip = tip_of(instrument, instrument.coils.front().offset_from_tip_mm, cameras);
  if (tip.verdict != Verdict::kGood) {
    if (!stretches.empty()) tip.found += "; no coil is near " + words_of(stretches);
    return {name, tip};
  }
  const double beyond_mm = instrument.length_mm - instrument.coils.back().offset_from_tip_mm;
  if (beyond_mm > CoilObservations::kHolds_mm) {
    return {name,
            {Verdict::kAdvice,
             fmt::format("{:.0f} mm lie beyond the last coil: {}their end may be {:.0f} mm off, one standard "
                         "deviation; no coil is near {}",
                         beyond_mm, cameras > 0 ? "where no image shows them " : "",
                         LooseEnds::bends_away_mm(beyond_mm), words_of(stretches)),
             "mount a coil there, or say in length_mm how much of the catheter you need"}};
  }
  if (!stretches.empty()) {
    return {name,
            {Verdict::kNote,
             fmt::format("no coil within {:.0f} mm of {} from the tip: {}", CoilObservations::kHolds_mm,
                         words_of(stretches),
                         cameras > 0
                             ? "out of view nothing holds the tube there, and one view leaves its depth open"
                             : "nothing holds the tube there"),
             ""}};
  }
  return {
      name,
      {Verdict::kGood,
       fmt::format("every place on it lies within {:.0f} mm of a coil", CoilObservations::kHolds_mm), ""}};
}

}  // namespace

std::vector<NamedFinding> examine_instruments(const Configuration& configuration) {
  const RoomDescription& room = configuration.room;
  std::vector<NamedFinding> findings;
  for (std::size_t i = 0; i < room.instruments.size(); ++i) {
    findings.push_back(examine(room.instruments[i], configuration.estimators[i].mode, room.cameras.size()));
  }
  return findings;
}

}  // namespace tubed
