// What the publisher thread hands to DDS besides the estimate, as plain values: no DDS header.
// Text longer than its field on the wire is cut; lengths are in the .idl files.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "idl/estimate.hpp"

namespace tubed {

/// One X-ray view, as in TubeIdentity.idl.
struct CameraIdentityValues {
  std::string name;
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::array<double, 2> focal_length_px{};
  std::array<double, 2> principal_point_px{};
  std::array<double, 5> distortion{};       ///< k1 k2 p1 p2 k3
  std::array<double, 16> T_camera_world{};  ///< row by row, mm
};

/// A tool in a plug of the tracker, as in TubeIdentity.idl.
struct ToolIdentityValues {
  std::uint32_t port = 0;
  std::uint32_t serial_number = 0;
  std::string part_number;
};

/// What the tracker says of itself; empty where it says nothing.
struct TrackerIdentityValues {
  std::string firmware;
  std::string api_revision;
  std::string control_unit_serial;
  std::string field_generator;
  std::vector<ToolIdentityValues> tools;  ///< at most kMaxTools
};

/// What is being tracked, by what, in which frames.
struct TubeIdentityValues {
  std::string instrument_id;  ///< 1 .. 64 characters
  std::string software_version;
  std::string configuration_digest;
  std::string mode;  ///< of the estimator
  float diameter_mm = 0;
  float length_mm = 0;
  std::vector<float> coil_offsets_from_tip_mm;  ///< at most kMaxCoils, tip first
  std::array<double, 16> T_world_em{};          ///< row by row, mm
  float registration_residual_mm = std::numeric_limits<float>::quiet_NaN();
  std::string world_frame;
  std::string world_axes;                     ///< "LPS", "RAS" or "as registered"
  std::vector<CameraIdentityValues> cameras;  ///< at most kMaxCameras
  TrackerIdentityValues tracker;
};

/// What one coil said, in the tracker's frame. status: 0 missing, 1 ok, 2 out of volume, 3 disabled.
struct EmCoilValues {
  std::uint32_t status = 0;
  std::array<double, 3> p_em_mm{};
  std::array<double, 3> tangent_em{};  ///< unit vector toward the tip
  float indicator = 0;
};

/// All coils of one measurement of one instrument.
struct EmSamplesValues {
  std::uint64_t sequence_number = 0;
  std::int64_t measured_ns = 0;  ///< CLOCK_MONOTONIC
  std::int64_t received_ns = 0;  ///< CLOCK_MONOTONIC
  std::uint32_t tracker_frame = 0;
  std::uint32_t origin = 0;  ///< 0 device, 1 simulated, 2 replayed
  std::uint32_t coil_count = 0;
  std::array<EmCoilValues, kMaxCoils> coils{};
};

/// The report of one stage under the name subscribers see.
struct NamedStageReport {
  std::string_view name;
  StageReport report;
};

/// What TubeHealth tells beside the stages. Counters only grow.
struct InstrumentHealthValues {
  std::uint64_t estimates = 0;
  std::array<std::uint32_t, 4> validity_counts{};  ///< by validity word
  LatencyHistogramValues exposure_to_publish;
  EmImageAgreement agreement;                          ///< of the newest estimate
  std::array<bool, kMaxStages> allocations_counted{};  ///< by stage
};

}  // namespace tubed
