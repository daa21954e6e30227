// Does a recording fit the room that is described for it? What an operator may have got wrong, with the
// evidence.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/evaluation/configured_sequence.hpp"

namespace tubed {

/// One thing that was looked at.
struct RecordingFinding {
  enum class Verdict { kFine, kWrong, kNotJudged };
  std::string what;  ///< "polarity"
  Verdict verdict = Verdict::kNotJudged;
  std::string evidence;  ///< with numbers
  std::string advice;    ///< what to do; empty where nothing has to be done
};

/// What is being done, for a person who waits.
using OnCheckProgress = std::function<void(const std::string& what)>;

/// Which way coils point: each has to point toward its neighbour that is nearer the tip. Of the measurements
/// alone.
RecordingFinding check_coil_directions(const Sequence& sequence);

/// Whether coils lie further apart than their arc lengths allow. Of the measurements alone.
RecordingFinding check_coil_distances(const Sequence& sequence);

/// Does any coil lie where a camera sees it, in any measurement? Of every twentieth. Where images say
/// themselves how their view stood that is not known, and may be.
bool is_any_coil_in_view(const Sequence& sequence);

/// Whether images were averaged over time by their console: a finding a camera where they were. Throws
/// SequenceError for an image that cannot be read.
std::vector<RecordingFinding> check_averaging(const Sequence& sequence);

/// All checks in the order in which mistakes hide each other: coils, the tube in the images, the
/// room's poses where they do not show it, polarity, mirroring and averaging of the images, then whether
/// coils and images agree over the whole recording, and whether the view moved. Throws SequenceError for an
/// image that cannot be read.
std::vector<RecordingFinding> check_recording(const ConfiguredSequence& run, const OnCheckProgress& progress);

}  // namespace tubed
