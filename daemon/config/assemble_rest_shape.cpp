#include <algorithm>
#include <cmath>

#include "daemon/config/assemble.hpp"
#include "drivers/interface/rest_curve_limits.hpp"

namespace tubed {

namespace {

/// The smallest radius of a tip's bend, and why it is that: a tube cannot be bent round its own inside.
struct LeastRadius {
  double mm = kMinRestRadius_mm;
  std::string why;
};

LeastRadius least_radius(const CheckedTable& table, const InstrumentDescription& instrument) {
  const double half_mm = instrument.diameter_mm / 2;
  if (!table.sound("diameter_mm") || half_mm <= kMinRestRadius_mm) return {};
  return {half_mm, ", half of diameter_mm,"};
}

/// Empty: nothing is wrong with it.
std::string fault_of_turns(const RestCurve& curve) {
  if (whole_turns(curve) <= kMaxRestTurns) return "";
  return "expected two turns at most, found " + to_toml(std::round(100 * whole_turns(curve)) / 100);
}

/// What is wrong with the arcs themselves; empty: nothing.
std::string fault_of_arcs(const std::vector<double>& numbers, const LeastRadius& least) {
  if (numbers.size() % 2 != 0) {
    return "expected pairs of length and radius, found " + std::to_string(numbers.size()) + " numbers";
  }
  const RestCurve curve = RestCurve::from_pairs(numbers);
  for (std::size_t i = 0; i < curve.arcs.size(); ++i) {
    const RestArc& arc = curve.arcs[i];
    const std::string which = "arc " + std::to_string(i + 1) + ": expected ";
    if (arc.length_mm < kMinRestArc_mm) {
      return which + "a length of " + to_toml(kMinRestArc_mm) + " mm or more, found " +
             to_toml(arc.length_mm);
    }
    if (arc.radius_mm != 0 && std::abs(arc.radius_mm) < least.mm) {
      return which + "a radius of " + to_toml(least.mm) + " mm" + least.why +
             " or more, or 0 for a straight piece, found " + to_toml(arc.radius_mm);
    }
  }
  if (curve.length_mm() == 0) {
    return "expected an arc with a radius; a tip that is straight by itself is rest_shape = \"straight\"";
  }
  return fault_of_turns(curve);
}

/// What is wrong with the stiffness of its pieces; empty: nothing.
std::string fault_of_stiffness(const InstrumentDescription& instrument) {
  if (instrument.stiffness.size() % 2 != 0) {
    return "expected pairs of length and stiffness, found " + std::to_string(instrument.stiffness.size()) +
           " numbers";
  }
  const StiffnessProfile profile = instrument.stiffness_profile();
  for (std::size_t i = 0; i < profile.pieces.size(); ++i) {
    const StiffnessProfile::Piece& piece = profile.pieces[i];
    const std::string which = "piece " + std::to_string(i + 1) + ": expected ";
    if (piece.length_mm < kMinStiffnessPiece_mm) {
      return which + "a length of " + to_toml(kMinStiffnessPiece_mm) + " mm or more, found " +
             to_toml(piece.length_mm);
    }
    if (piece.times > kMaxStiffness) {
      return which + "a stiffness of " + to_toml(kMaxStiffness) + " times the shaft's or less, found " +
             to_toml(piece.times);
    }
  }
  if (profile.length_mm() >= instrument.length_mm) {
    return "expected less than the instrument's length_mm, " + to_toml(instrument.length_mm) +
           " mm, in all, found " + to_toml(profile.length_mm());
  }
  return "";
}

void check_keys_of_rest_shape(const CheckedTable& table, RestShape rest_shape, Problems& problems) {
  struct KeyOfShape {
    const char* key;
    RestShape shape;
    const char* shape_word;
    const char* needs;
  };
  constexpr const char* kHookNeeds = "a hook needs hook_radius_mm and hook_length_mm; ";
  for (const KeyOfShape& of :
       {KeyOfShape{"hook_radius_mm", RestShape::kHook, "hook", kHookNeeds},
        KeyOfShape{"hook_length_mm", RestShape::kHook, "hook", kHookNeeds},
        KeyOfShape{"rest_arcs_mm", RestShape::kArcs, "arcs", "arcs need their numbers; "}}) {
    const bool is_it = rest_shape == of.shape;
    if (is_it && table.at(of.key).state == ValueState::kAbsent) {
      problems.push_back({table.at("rest_shape").position, table.path_of("rest_shape"),
                          std::string(of.needs) + of.key + " is missing"});
    } else if (!is_it && table.has(of.key)) {
      problems.push_back({table.at(of.key).position, table.path_of(of.key),
                          std::string("means nothing without rest_shape = \"") + of.shape_word +
                              "\": expected both or neither"});
    }
  }
}

}  // namespace

void check_rest_shape(const CheckedTable& table, const InstrumentDescription& instrument,
                      Problems& problems) {
  check_keys_of_rest_shape(table, instrument.rest_shape, problems);
  if (instrument.trust_straight && instrument.rest_shape != RestShape::kStraight) {
    problems.push_back({table.at("trust_straight").position, table.path_of("trust_straight"),
                        "means nothing without rest_shape = \"straight\": expected both or neither"});
  }
  const auto refuse = [&](const char* key, const std::string& words) {
    problems.push_back({table.at(key).position, table.path_of(key), words});
  };
  const LeastRadius least = least_radius(table, instrument);
  const bool is_hook = instrument.rest_shape == RestShape::kHook;
  if (is_hook && table.has("hook_radius_mm") && instrument.hook_radius_mm < least.mm) {
    refuse("hook_radius_mm", "expected " + to_toml(least.mm) + " mm" + least.why + " or more, found " +
                                 to_toml(instrument.hook_radius_mm));
    return;
  }
  const char* const key = is_hook ? "hook_length_mm" : "rest_arcs_mm";
  if (!is_preshaped(instrument.rest_shape) || !table.has(key)) {
    return;
  }
  std::string fault;
  if (!is_hook) fault = fault_of_arcs(instrument.rest_arcs_mm, least);
  if (is_hook && table.has("hook_radius_mm")) fault = fault_of_turns(instrument.rest_curve());
  if (!fault.empty()) {
    refuse(key, fault);
  } else if (const double bent_mm = is_hook ? instrument.hook_length_mm : instrument.rest_curve().length_mm();
             bent_mm >= instrument.length_mm) {
    refuse(key, "expected less than the instrument's length_mm, " + to_toml(instrument.length_mm) +
                    " mm, found " + to_toml(bent_mm));
  }
}

void check_stiffness(const CheckedTable& table, const InstrumentDescription& instrument, Problems& problems) {
  if (!table.sound("stiffness") || !table.has("stiffness")) return;
  const std::string fault = fault_of_stiffness(instrument);
  if (!fault.empty()) problems.push_back({table.at("stiffness").position, table.path_of("stiffness"), fault});
}

}  // namespace tubed
