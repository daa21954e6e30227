// What leaves the pipeline, as plain values: the in-process form of the DDS topics. No allocation, no DDS
// header; publishing turns these into the generated types. Lengths mm, frame "world" unless a name says
// otherwise, time ns of the host's CLOCK_MONOTONIC. "toward the tip" and "tip first" mean arc length s = 0 at
// the tip.
#pragma once

#include <array>
#include <cstdint>

#include "idl/validity.hpp"

namespace tubed {

inline constexpr int kMaxCentrelinePoints = 128;
inline constexpr int kMaxCoefficients = 64;
inline constexpr int kMaxCoils = 16;
inline constexpr int kMaxCameras = 4;
inline constexpr int kMaxInstruments = 8;
inline constexpr int kMaxStages = 24;
inline constexpr int kMaxTools = 16;
inline constexpr int kInstrumentIdLength = 64;

/// One point of the centreline.
struct CentrelinePoint {
  std::array<double, 3> p_world_mm{};     ///< position
  std::array<float, 3> tangent_world{};   ///< unit vector toward the tip
  std::array<float, 6> covariance_mm2{};  ///< of the position: xx xy xz yy yz zz; infinity: unknown
  std::uint32_t held_by = 0;              ///< kHeldByCoil, kHeldByImage; 0: the tube's stiffness alone
};
inline constexpr std::uint32_t kHeldByCoil = 1;   ///< a coil that is used lies within 30 mm along the tube
inline constexpr std::uint32_t kHeldByImage = 2;  ///< the newest image of a camera shows the tube there

/// What one coil said and how far the shape is from it.
enum class CoilState : std::uint32_t {
  kMissing = 0,
  kUsed = 1,
  kOutOfVolume = 2,
  kDisabled = 3,
  kOutlier = 4,
  kStuck = 5
};
struct CoilResidual {
  CoilState state = CoilState::kMissing;
  float offset_from_tip_mm = 0;  ///< s of the coil along the catheter
  float position_mm = 0;         ///< |zeta(s_i) - p_i|, NaN when the coil gave nothing
  float angle_rad = 0;           ///< between tangent and t_i, NaN when the coil gave nothing
};

/// A camera as it stood when its newest image was taken that the shape uses.
struct ViewUsed {
  std::uint32_t camera = 0;       ///< index in the configuration
  bool has_own_geometry = false;  ///< it came with the image; else the configuration's
  std::int64_t exposure_monotonic_ns = 0;
  std::array<double, 2> focal_length_px{};
  std::array<double, 2> principal_point_px{};
  std::array<double, 16> T_camera_world{};  ///< row by row, mm: p_camera = T_camera_world * p_world
  std::array<float, 3>
      sigma_rotation_rad{};  ///< of a pose that came with the image, as PoseSigma; 0: not stated
  std::array<float, 3> sigma_translation_mm{};  ///< of the same
};

/// When the newest measurement of this estimate passed each stage; 0 = did not take part.
struct StageStamps {
  std::int64_t exposure_ns = 0;  ///< mid exposure of the newest image used
  std::int64_t image_grabbed_ns = 0;
  std::int64_t frangi_started_ns = 0;
  std::int64_t frangi_finished_ns = 0;
  std::int64_t em_measured_ns = 0;  ///< time of the newest EM measurement used
  std::int64_t em_received_ns = 0;
  std::int64_t optimizer_started_ns = 0;
  std::int64_t optimizer_finished_ns = 0;
};

/// What may explain that coils and images contradict each other.
enum class Discord : std::uint32_t {
  kNone = 0,           ///< nothing has to be explained
  kRegistration = 1,   ///< all coils are off together: registration, table or the camera's pose
  kArcLengths = 2,     ///< the tube ends elsewhere in the image than the coils' arc lengths say
  kClock = 3,          ///< images are stamped too late or too early
  kMagnification = 4,  ///< the image is larger or smaller than its focal length and distance say
  kField = 5,          ///< coils are off, each in its own way: metal near the tracker, another field
  kCoil = 6,           ///< one coil is off: bent, or measured wrong
  kCoilArcLength = 7,  ///< one coil lies elsewhere along the tube than its arc length says
  kNegative = 8,  ///< tubes are bright in images where dark ones are sought, or dark where bright ones are
  kMirrored = 9,  ///< images are mirrored left to right
};

/// Do the coils lie where images show the tube? As EmImageAgreement of TubeHealth.idl says it.
struct EmImageAgreement {
  bool disagree = false;  ///< the reason EM_IMAGE_DISAGREE is given
  Discord explanation = Discord::kNone;
  /// Of the camera (kMagnification, kNegative, kMirrored) or the coil (kCoil, kCoilArcLength).
  std::uint32_t index = 0;
  /// Of that explanation; 0: nothing was compared yet. Of kNegative and kMirrored the share of the tube's
  /// lines that agree with images that are read so.
  float probability = 0;
  float as_stated = 0;              ///< probability that everything is as the configuration states it
  std::array<float, 3> shift_mm{};  ///< of the registration, in the middle of the tube; world
  std::array<float, 3> turn_rad{};  ///< of the registration, rotation vector; world
  float unsure_mm = 0;   ///< how far off its shift may still be, root mean square; one view sees no depth
  float unsure_rad = 0;  ///< the same of its turn
  std::array<float, 3> coil_mm{};  ///< of the coil at `index`, across the tube; world
  float arc_length_mm = 0;  ///< stated arc lengths are too large by this; of one coil where `index` is one
  float end_mm = 0;         ///< the tube ends further out in the image than coils and arc lengths say
  float clock_s = 0;        ///< images are stamped too late
  float magnification = 0;  ///< the stated focal length of the camera at `index` is too large, relative
};

/// In place of an age: there never was such a measurement, or there is no shape yet.
inline constexpr std::int64_t kNoAge = -1;

/// One shape of one instrument. Written by the estimator (shape, validity) and the optimizer stage (stamps).
struct TubeEstimate {
  std::uint32_t instrument = 0;       ///< index in the configuration
  std::uint64_t sequence_number = 0;  ///< + 1 an estimate and instrument, from 1
  std::int64_t valid_time_ns = 0;     ///< the instant the shape is of; never moved afterwards
  Validity validity = Validity::kNotAvailable;
  Reasons reasons;
  bool has_image = false;         ///< an image of this very instant took part
  bool is_image_instant = false;  ///< made because an image instant was due, not by the clock
  std::uint32_t image_frame = 0;  ///< the source's frame number of that image
  std::uint32_t em_frame = 0;     ///< the tracker's frame number of the newest measurement used
  /// valid_time_ns minus the time of the newest EM measurement, and of the newest image, that took part;
  /// negative when it is younger than the shape's instant, kNoAge: never one.
  std::int64_t em_age_ns = kNoAge;
  std::int64_t image_age_ns = kNoAge;
  float radius_mm = 0;
  float length_mm = 0;           ///< arc length the points cover, from the tip
  float image_inlier_ratio = 0;  ///< share of the tube's lines in view that agree with it; 0 without image
  float in_view_ratio = 0;       ///< share of the tube inside an image
  std::uint32_t iterations = 0;
  std::uint32_t point_count = 0;
  std::array<CentrelinePoint, kMaxCentrelinePoints> points{};  ///< uniform in s from 0 to length_mm
  std::uint32_t coefficient_count = 0;
  float coefficient_spacing_mm = 0;  ///< of the uniform cubic B-spline in s; see clients/cpp to evaluate it
  std::array<std::array<double, 3>, kMaxCoefficients> coefficients_mm{};
  std::uint32_t coil_count = 0;
  std::array<CoilResidual, kMaxCoils> coils{};
  std::uint32_t view_count = 0;
  std::array<ViewUsed, kMaxCameras> views{};  ///< those that take part
  StageStamps stamps;
  EmImageAgreement agreement;  ///< not part of TubeEstimate.idl: TubeHealth carries it
};

/// Log-spaced latency histogram: bucket i counts values in [2^(i/4), 2^((i+1)/4)) microseconds; the last one
/// the rest.
inline constexpr int kLatencyBuckets = 96;
struct LatencyHistogramValues {
  std::uint64_t count = 0;
  std::int64_t max_ns = 0;
  std::array<std::uint32_t, kLatencyBuckets> buckets{};
};

/// What state a stage or source is in.
enum class StageState : std::uint32_t {
  kStarting = 0,
  kRunning = 1,
  kDegraded = 2,
  kReconnecting = 3,
  kEnded = 4,
  kFailed = 5
};

/// What is said of an instrument besides its shapes.
struct InstrumentStatus {
  Validity validity =
      Validity::kNotAvailable;  ///< of the newest estimate, NOT_AVAILABLE when that is too old
  Reasons reasons;
  std::int64_t estimate_age_ns = -1;  ///< since the newest estimate was written, -1 = never one
};

/// What a stage tells of itself, newest wins. Counters only grow.
struct StageReport {
  StageState state = StageState::kStarting;
  std::int64_t since_ns = 0;     ///< when the state was entered
  std::int64_t reported_ns = 0;  ///< when the stage's thread said this, 0 = never
  std::array<char, 256> why{};   ///< zero-terminated, in words: the cause first
  std::uint64_t steps = 0;
  std::uint64_t outputs = 0;
  std::uint64_t dropped = 0;  ///< superseded before use, or ring full
  std::uint64_t refused = 0;  ///< bad input counted and not used
  std::uint64_t reconnects = 0;
  std::uint64_t allocations = 0;  ///< heap allocations since the thread started, when counted
  std::uint64_t locks = 0;        ///< mutexes and rwlocks taken since then, when counted
  std::uint64_t exceptions = 0;   ///< thrown since then, when counted
  bool costs_counted = false;     ///< the three above are real
  LatencyHistogramValues busy;    ///< duration of a step
};

}  // namespace tubed
