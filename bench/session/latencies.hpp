// Figures of a session: latencies in ms from the intended exposure, and what became of every image.
#pragma once

#include <string>
#include <vector>

#include "bench/session/session.hpp"

namespace tubed {

/// Values with the time, s since the counting began, of what each is about.
struct TimedValues {
  std::vector<double> values;
  std::vector<double> t_s;

  void append(const TimedValues& later, double shift_s);
};

/// What became of the images.
struct ImageCounts {
  double injected = 0;
  double used = 0;        ///< an estimate of the first instrument was made from it and written
  double superseded = 0;  ///< never became an estimate: a newer one was there first
  double late = 0;        ///< of the used ones: written more than a period after the exposure
};

/// Exposure to dds_write returned, estimates of the first instrument that an image took part in.
TimedValues exposure_to_written(const SessionRecord& record);
/// Exposure to received; one subscriber.
TimedValues exposure_to_received(const SessionRecord& record, const std::vector<ReceivedEstimate>& received);
/// For every image that was injected, used or not: until an estimate made from it or from a newer one was
/// written. Superseded images count with what a subscriber really waits.
TimedValues exposure_to_newer_shape(const SessionRecord& record);

/// The way of an image through the contestant: "grab", "wake frangi", "frangi", "wake optimizer",
/// "optimizer", "wake publisher", "dds_write".
struct StageTimes {
  std::string stage;
  TimedValues times;
};
std::vector<StageTimes> stage_times(const SessionRecord& record);

ImageCounts count_images(const SessionRecord& record, double period_ms);
/// Samples missing by their sequence numbers.
double lost_of(const std::vector<ReceivedEstimate>& received);
/// Share of one core, %, second by second.
TimedValues cpu_percent(const SessionRecord& record);
/// CPU time for each shape made from an image, ms, everything else the contestant does included: unlike
/// latency it hardly depends on what else the machine does. One value; none when no shape was made.
TimedValues cpu_ms_a_shape(const SessionRecord& record);
/// Resident memory, MB, second by second.
TimedValues resident_mb(const SessionRecord& record);

}  // namespace tubed
