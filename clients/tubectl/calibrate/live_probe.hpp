// A tracked probe as a running daemon publishes it, and what a person types meanwhile.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "clients/calibration/probe_pose.hpp"
#include "clients/cpp/topic_reader.hpp"
#include "idl/EmSamples.h"

namespace tubed {

/// Coil `coil`, from 1, of a measurement as a probe whose z axis is the coil's tangent. Throws
/// std::runtime_error when the instrument has no such coil.
ProbePose probe_pose(const tubed_EmSamples& sample, int coil);

/// One coil of one instrument, measurement by measurement. One thread at a time.
class LiveProbe {
 public:
  /// Throws DdsError as TopicReader does.
  LiveProbe(const Subscription& subscription, int coil) : reader_(subscription), coil_(coil) {}

  /// The next measurement; nothing when none came within `timeout`. Throws std::runtime_error when the
  /// instrument has no such coil, and when a second instrument publishes while none was chosen.
  std::optional<ProbePose> wait_for(std::chrono::milliseconds timeout);

 private:
  TopicReader<tubed_EmSamples> reader_;
  int coil_;
  std::string instrument_id_;  ///< of the first measurement
};

/// Lines of standard input without waiting for them.
class TypedLines {
 public:
  /// The next whole line that is there; nothing when there is none. After the end of input "q", again and
  /// again.
  std::optional<std::string> next();

 private:
  std::string typed_;
  bool is_open_ = true;
};

}  // namespace tubed
