#include "drivers/laboratory/room_mistakes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>

#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/gaussian.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kRegistrationStream = 7301;
constexpr std::int64_t kPoseStream = 7303;
constexpr double kMaxOffset_mm = 2000;  // as in coil_keys()

/// One number after the "=".
struct MistakeValue {
  std::string_view name;
  double min;
  double max;
  bool is_whole = false;
  bool may_be_left_out = false;
};

using Values = std::vector<double>;

/// A mistake: its name, the numbers it takes, and what they do.
struct MistakeKind {
  std::string_view name;
  std::vector<MistakeValue> values;
  std::string_view meaning;
  std::function<void(RoomMistakes&, const Values&)> take;
};

const std::vector<MistakeKind>& mistake_kinds() {
  using M = RoomMistakes;
  static const std::vector<MistakeKind> kinds{
      {"registration",
       {{"MM", 0, 200}, {"DEG", 0, 180}},
       "the described T_world_em is off by a shift and by a turn about the middle of the catheter's region, "
       "both in directions drawn from the seed",
       [](M& m, const Values& v) { m.registration_mm = v[0], m.registration_deg = v[1]; }},
      {"offsets",
       {{"MM", -500, 500}},
       "all coils are described so much too far from the tip: another catheter than the one in use",
       [](M& m, const Values& v) { m.offsets_mm = v[0]; }},
      {"offset",
       {{"COIL", 1, kMaxTrackerCoils, true}, {"MM", -500, 500}},
       "the same of one coil, by its sensor's number; may be given for several",
       [](M& m, const Values& v) { m.offset_mm[static_cast<int>(v[0])] = v[1]; }},
      {"focal",
       {{"FACTOR", 0.2, 5}},
       "the described fx and fy are so many times the true ones",
       [](M& m, const Values& v) { m.focal = v[0]; }},
      {"pose",
       {{"MM", 0, 200}, {"DEG", 0, 180}},
       "the described T_camera_world of each view is off by a shift and by a turn about the middle of the "
       "catheter's region, both in directions drawn from the seed",
       [](M& m, const Values& v) { m.pose_mm = v[0], m.pose_deg = v[1]; }},
      {"clock",
       {{"MS", -5000, 5000}},
       "images' stamps are so late against the coils'; negative: early",
       [](M& m, const Values& v) { m.clock_ms = v[0]; }},
      {"field-jump",
       {{"MM", 0, 100}, {"SECOND", 0, 1e6, false, true}},
       "half way through, or at that second, the tracker's field is bent anew by so much, smoothly, and "
       "stays so: somebody rolls a table of instruments beside it",
       [](M& m, const Values& v) {
         m.field_jump_mm = v[0];
         if (v.size() > 1) m.field_jump_s = v[1];
       }},
      {"averaging",
       {{"SHARE", 0, 0.9}, {"LIMIT", 0, 100, false, true}},
       "the console averages its pictures over time: so much of the one before stays in each, and what moves "
       "lags behind; with a limit it averages less where something changes by more than so many times noise",
       [](M& m, const Values& v) {
         m.averaging = v[0];
         if (v.size() > 1) m.averaging_limit = v[1];
       }},
      {"polarity",
       {},
       "pictures come as negatives: the catheter is bright",
       [](M& m, const Values&) { m.inverts = true; }},
      {"mirrored", {}, "pictures come mirrored left to right", [](M& m, const Values&) { m.mirrors = true; }},
      {"coil-order",
       {},
       "the coils' arc lengths are given to the sensors in reverse order",
       [](M& m, const Values&) { m.reverses_coils = true; }},
      {"coil-direction",
       {},
       "measured tangents of all coils point away from the tip",
       [](M& m, const Values&) { m.flips_coils = true; }}};
  return kinds;
}

std::string form_of(const MistakeKind& kind) {
  std::string form(kind.name);
  for (std::size_t i = 0; i < kind.values.size(); ++i) {
    const MistakeValue& value = kind.values[i];
    form += i == 0 ? "=" : value.may_be_left_out ? "[," : ",";
    form += value.name;
    form += value.may_be_left_out ? "]" : "";
  }
  return form;
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

[[noreturn]] void refuse(const MistakeKind& kind, const std::string& word) {
  std::string words = "mistake \"" + word + "\": expected " + form_of(kind);
  for (const MistakeValue& value : kind.values) {
    words += std::string(&value == &kind.values.front() ? " with " : ", ") + std::string(value.name) + " " +
             (value.is_whole ? "a whole number " : "") + "from " + number_text(value.min) + " to " +
             number_text(value.max);
  }
  throw std::invalid_argument(words + (kind.values.empty() ? ", without a value" : ""));
}

[[noreturn]] void refuse_unknown(const std::string& word) {
  std::string known;
  for (const MistakeKind& kind : mistake_kinds()) {
    known += (known.empty() ? "" : ", ") + form_of(kind);
  }
  throw std::invalid_argument("there is no mistake \"" + word + "\"; there are " + known);
}

/// The numbers between the commas of `text`; nothing when one is none.
std::optional<Values> numbers_of(std::string_view text) {
  Values values;
  while (true) {
    const std::string_view word = text.substr(0, text.find(','));
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
    values.push_back(value);
    if (word.size() == text.size()) return values;
    text.remove_prefix(word.size() + 1);
  }
}

bool fits(const MistakeKind& kind, const Values& values) {
  const auto& asked = kind.values;
  const auto least = static_cast<std::size_t>(std::count_if(
      asked.begin(), asked.end(), [](const MistakeValue& value) { return !value.may_be_left_out; }));
  if (values.size() < least || values.size() > asked.size()) return false;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool in_range = values[i] >= asked[i].min && values[i] <= asked[i].max;  // never true for NaN
    if (!in_range || (asked[i].is_whole && values[i] != std::floor(values[i]))) return false;
  }
  return true;
}

/// Shift by `shift_mm` and turn by `turn_deg` about `middle_world_mm`, both in drawn directions; world frame.
RigidTransform drawn_motion(CounterRandom random, double shift_mm, double turn_deg,
                            const Eigen::Vector3d& middle_world_mm) {
  const Eigen::Vector3d shift_world_mm = shift_mm * gaussian_vector(random).normalized();
  const Eigen::Vector3d axis_world = gaussian_vector(random).normalized();
  const Eigen::Translation3d middle(middle_world_mm);
  return RigidTransform(Eigen::Translation3d(shift_world_mm) * middle *
                        Eigen::AngleAxisd(turn_deg * kDegree, axis_world) * middle.inverse());
}

/// E of described T_world_em = E * true T_world_em.
RigidTransform registration_error(const RoomMistakes& mistakes, const MistakeDraw& draw) {
  return drawn_motion(CounterRandom(draw.seed, kRegistrationStream, 0), mistakes.registration_mm,
                      mistakes.registration_deg, draw.middle_world_mm);
}

bool poses_are_off(const RoomMistakes& mistakes) { return mistakes.pose_mm != 0 || mistakes.pose_deg != 0; }

/// E of described T_camera_world = true T_camera_world * E, of that camera.
RigidTransform pose_error(const RoomMistakes& mistakes, const MistakeDraw& draw, std::size_t camera) {
  return drawn_motion(CounterRandom(draw.seed, kPoseStream, static_cast<std::int64_t>(camera)),
                      mistakes.pose_mm, mistakes.pose_deg, draw.middle_world_mm);
}

double offset_error_mm(const RoomMistakes& mistakes, int sensor) {
  const auto found = mistakes.offset_mm.find(sensor);
  return mistakes.offsets_mm + (found == mistakes.offset_mm.end() ? 0 : found->second);
}

/// Adds `sign` times what their descriptions are off by to the arc lengths.
void shift_coils(InstrumentDescription& instrument, const RoomMistakes& mistakes, double sign) {
  if (mistakes.offsets_mm == 0 && mistakes.offset_mm.empty()) return;
  double before_mm = -1;
  for (CoilPlacement& coil : instrument.coils) {
    const double given_mm = coil.offset_from_tip_mm;
    coil.offset_from_tip_mm += sign * offset_error_mm(mistakes, coil.sensor);
    if (coil.offset_from_tip_mm < 0 || coil.offset_from_tip_mm > kMaxOffset_mm ||
        coil.offset_from_tip_mm <= before_mm) {
      throw std::invalid_argument(
          "mistake offset: the coil of sensor " + std::to_string(coil.sensor) + ", " + number_text(given_mm) +
          " mm from the tip, would come to " + number_text(coil.offset_from_tip_mm) +
          " mm; expected an error with which the coils keep their order between 0 and " +
          number_text(kMaxOffset_mm) + " mm");
    }
    before_mm = coil.offset_from_tip_mm;
  }
}

/// The arc lengths stay, what is at them is in reverse order.
void reverse_coils(InstrumentDescription& instrument) {
  std::vector<CoilPlacement> reversed(instrument.coils.rbegin(), instrument.coils.rend());
  for (std::size_t i = 0; i < reversed.size(); ++i) {
    reversed[i].offset_from_tip_mm = instrument.coils[i].offset_from_tip_mm;
  }
  instrument.coils = std::move(reversed);
}

void scale_focal_lengths(RoomDescription& room, double factor) {
  for (CameraCalibration& camera : room.cameras) {
    camera.fx *= factor;
    camera.fy *= factor;
  }
}

void refuse_unknown_coils(const RoomDescription& room, const RoomMistakes& mistakes) {
  std::set<int> sensors;
  for (const InstrumentDescription& instrument : room.instruments) {
    for (const CoilPlacement& coil : instrument.coils) sensors.insert(coil.sensor);
  }
  for (const auto& [sensor, error_mm] : mistakes.offset_mm) {
    if (!sensors.contains(sensor)) {
      throw std::invalid_argument("mistake offset: no coil has sensor " + std::to_string(sensor));
    }
  }
}

}  // namespace

std::vector<MistakeHelp> mistakes_help() {
  std::vector<MistakeHelp> help;
  for (const MistakeKind& kind : mistake_kinds()) {
    help.push_back({form_of(kind), kind.meaning});
  }
  return help;
}

RoomMistakes parse_mistakes(const std::vector<std::string>& words) {
  RoomMistakes mistakes;
  std::set<std::string> given;
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    const auto& kinds = mistake_kinds();
    const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                   [&](const MistakeKind& known) { return known.name == name; });
    if (kind == kinds.end()) refuse_unknown(word);
    const bool has_values = word.size() > name.size();
    const auto values =
        has_values ? numbers_of(std::string_view(word).substr(name.size() + 1)) : std::optional(Values{});
    if (!values || has_values == kind->values.empty() || !fits(*kind, *values)) refuse(*kind, word);
    const std::string once = name == "offset" ? name + number_text(values->front()) : name;
    if (!given.insert(once).second) {
      throw std::invalid_argument("mistake \"" + word + "\": " + name + " is given twice");
    }
    kind->take(mistakes, *values);
  }
  return mistakes;
}

std::vector<std::string> mistake_words(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  std::vector<std::string> words;
  while (true) {
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return words;
    text.remove_prefix(first);
    words.emplace_back(text.substr(0, text.find_first_of(kBlanks)));
    text.remove_prefix(words.back().size());
  }
}

RoomDescription described_room(RoomDescription room, const RoomMistakes& mistakes, const MistakeDraw& draw) {
  refuse_unknown_coils(room, mistakes);
  if (mistakes.registration_mm != 0 || mistakes.registration_deg != 0) {
    room.T_world_em = registration_error(mistakes, draw) * room.T_world_em;
  }
  scale_focal_lengths(room, mistakes.focal);
  for (std::size_t i = 0; poses_are_off(mistakes) && i < room.cameras.size(); ++i) {
    room.cameras[i].T_camera_world = room.cameras[i].T_camera_world * pose_error(mistakes, draw, i);
  }
  for (InstrumentDescription& instrument : room.instruments) shift_coils(instrument, mistakes, 1);
  return room;
}

ViewGeometry described_view(ViewGeometry view, const RoomMistakes& mistakes, const MistakeDraw& draw,
                            std::size_t camera) {
  view.fx *= mistakes.focal;
  view.fy *= mistakes.focal;
  if (!poses_are_off(mistakes)) return view;
  const RigidTransform described = view.T_camera_world() * pose_error(mistakes, draw, camera);
  const Eigen::Quaterniond q(described.linear());
  const Eigen::Vector3d t_mm = described.translation();
  view.q_camera_world = {q.w(), q.x(), q.y(), q.z()};
  view.t_camera_world_mm = {t_mm.x(), t_mm.y(), t_mm.z()};
  return view;
}

RoomDescription real_room(RoomDescription described, const RoomMistakes& mistakes, const MistakeDraw& draw) {
  refuse_unknown_coils(described, mistakes);
  if (mistakes.registration_mm != 0 || mistakes.registration_deg != 0) {
    described.T_world_em = registration_error(mistakes, draw).inverse() * described.T_world_em;
  }
  scale_focal_lengths(described, 1 / mistakes.focal);
  for (std::size_t i = 0; poses_are_off(mistakes) && i < described.cameras.size(); ++i) {
    RigidTransform& T_camera_world = described.cameras[i].T_camera_world;
    T_camera_world = T_camera_world * pose_error(mistakes, draw, i).inverse();
  }
  for (InstrumentDescription& instrument : described.instruments) {
    shift_coils(instrument, mistakes, -1);
    if (mistakes.reverses_coils) reverse_coils(instrument);
  }
  return described;
}

}  // namespace tubed
