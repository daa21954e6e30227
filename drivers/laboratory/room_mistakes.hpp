// What people and rooms get wrong: a description that does not fit the room, clocks that differ, a field that
// is bent anew. Nothing here changes where the catheter is.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/interface/room.hpp"

namespace tubed {

/// How far off what is. Nothing is wrong by default.
struct RoomMistakes {
  double registration_mm = 0;   ///< shift of the described T_world_em, in a direction drawn from the seed
  double registration_deg = 0;  ///< its turn about a drawn axis through the middle of the catheter's region
  double offsets_mm = 0;        ///< by which all coils are described too far from the tip
  std::map<int, double> offset_mm;  ///< the same of single coils, by sensor
  double focal = 1;                 ///< described focal lengths over the true ones
  double pose_mm = 0;   ///< shift of the patient in each described camera, in a direction drawn for it
  double pose_deg = 0;  ///< turn of the patient there, about a drawn axis through the middle of the region
  double clock_ms = 0;  ///< by which stamps of images are late against those of coils
  double field_jump_mm = 0;  ///< greatest displacement, in the working volume, by the field that comes anew
  std::optional<double> field_jump_s;  ///< when; nothing: half way through
  double averaging = 0;                ///< share of the pictures before that stays in each picture
  double averaging_limit = 0;   ///< times noise; what changes by more is averaged less; 0: all is alike
  bool inverts = false;         ///< pictures come as negatives
  bool mirrors = false;         ///< rows of pictures come from right to left
  bool reverses_coils = false;  ///< sensors are plugged in, or their arc lengths written, in reverse order
  bool flips_coils = false;     ///< measured tangents point away from the tip

  /// What stamps of images, and of coils, are late by, s: one of the two is zero.
  [[nodiscard]] double image_stamp_error_s() const { return clock_ms > 0 ? 1e-3 * clock_ms : 0; }
  [[nodiscard]] double em_stamp_error_s() const { return clock_ms < 0 ? -1e-3 * clock_ms : 0; }
};

/// A line of the list of mistakes for a person.
struct MistakeHelp {
  std::string form;  ///< "registration=MM,DEG"
  std::string_view meaning;
};

/// All mistakes there are.
std::vector<MistakeHelp> mistakes_help();

/// `words`: "registration=6,2", "polarity", ..., each at most once ("offset" once a coil). Throws
/// std::invalid_argument that says what is expected.
RoomMistakes parse_mistakes(const std::vector<std::string>& words);

/// The words of a text, between blanks.
std::vector<std::string> mistake_words(std::string_view text);

/// What is drawn of mistakes.
struct MistakeDraw {
  std::int64_t seed = 1;
  Eigen::Vector3d middle_world_mm = Eigen::Vector3d::Zero();  ///< of the catheter's region
};

/// The room as whoever makes these mistakes describes it: registration, arc lengths, focal lengths, poses.
/// Throws std::invalid_argument where coils would be described out of their order or beyond the tip.
RoomDescription described_room(RoomDescription room, const RoomMistakes& mistakes, const MistakeDraw& draw);

/// What an image says of a view that stands as `view`: focal lengths and pose as described_room() has those
/// of that camera, `camera` its place in the room's list.
ViewGeometry described_view(ViewGeometry view, const RoomMistakes& mistakes, const MistakeDraw& draw,
                            std::size_t camera);

/// What such a description is of: real_room(described_room(room)) is `room`, to rounding, with the sensors of
/// each instrument in reverse order if they are reversed. Throws as described_room().
RoomDescription real_room(RoomDescription described, const RoomMistakes& mistakes, const MistakeDraw& draw);

}  // namespace tubed
