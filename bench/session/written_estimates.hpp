// When each write of a TubeEstimate began and returned: written by a library that is loaded into the
// unchanged daemon before Cyclone and stands in front of dds_write.
#pragma once

#include <cstdint>

namespace tubed {

/// Environment variable with the path of the file.
inline constexpr const char* kWrittenEstimatesVariable = "TUBED_BENCH_WRITTEN_ESTIMATES";

/// One write; times of CLOCK_MONOTONIC, stamps 0 when the stage took no part.
struct WrittenEstimate {
  std::uint64_t sequence_number;
  std::uint32_t instrument;  ///< the number at the end of its id, "cath-1": 1
  std::uint32_t image_frame;
  std::uint32_t validity;
  std::uint32_t has_image;
  std::int64_t exposure_ns;
  std::int64_t image_grabbed_ns;
  std::int64_t frangi_started_ns;
  std::int64_t frangi_finished_ns;
  std::int64_t em_measured_ns;
  std::int64_t optimizer_started_ns;
  std::int64_t optimizer_finished_ns;
  std::int64_t publish_started_ns;
  std::int64_t write_called_ns;
  std::int64_t write_returned_ns;
};

/// The file: this, then `most` entries, of which `count` are written.
struct WrittenEstimatesHead {
  std::uint64_t count;
  std::uint64_t most;
};

}  // namespace tubed
