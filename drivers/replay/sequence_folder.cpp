#include "drivers/replay/sequence_folder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "drivers/csv/csv_reader.hpp"

namespace tubed {

namespace {

constexpr double kUnitTolerance = 1e-2;  ///< of tangents and quaternions, which files round to a few digits
constexpr double kMaxTime_s = 1e9;       ///< the replay counts in ns
constexpr double kArcLengthTolerance_mm = 1e-6;

constexpr std::array<std::pair<std::string_view, CoilStatus>, 4> kStatusWords{{
    {"OK", CoilStatus::kOk},
    {"MISSING", CoilStatus::kMissing},
    {"OUT_OF_VOLUME", CoilStatus::kOutOfVolume},
    {"DISABLED", CoilStatus::kDisabled},
}};

/// Refuses a time that lies before the last one of the same file.
class RisingTime {
 public:
  double next(const CsvReader& csv, std::size_t column) {
    const double t_s = csv.number(column);
    if (std::abs(t_s) > kMaxTime_s) {
      csv.refuse(column, "the time is beyond 1e9 s; times count in seconds from the start of the sequence");
    }
    if (t_s < last_s_) {
      csv.refuse(column, "the time goes backwards; order the rows by time");
    }
    return last_s_ = t_s;
  }

 private:
  double last_s_ = -std::numeric_limits<double>::infinity();
};

namespace frames_csv {
enum Column : std::size_t { kFrame, kTime, kCamera, kFile };
}

namespace em_csv {
enum Column : std::size_t {
  kTime,
  kFrame,
  kSensor,
  kStatus,
  kX,
  kY,
  kZ,
  kTx,
  kTy,
  kTz,
  kQw,
  kQx,
  kQy,
  kQz,
  kError
};
}

namespace geometry_csv {
enum Column : std::size_t {
  kFrame,
  kFx,
  kFy,
  kCx,
  kCy,
  kQw,
  kX = kQw + 4,
  kSigmaRotation = kX + 3,
  kSigmaTranslation = kSigmaRotation + 3,
  kPivotDepth = kSigmaTranslation + 3
};
}

namespace truth_csv {
enum Column : std::size_t { kFrame, kArcLength, kX, kY, kZ };
}

int camera_named(const CsvReader& csv, std::size_t column, const RoomDescription& room) {
  const auto found =
      std::find_if(room.cameras.begin(), room.cameras.end(),
                   [&](const CameraCalibration& camera) { return camera.name == csv.text(column); });
  if (found == room.cameras.end()) {
    csv.refuse(column, "sequence.toml has no [[camera]] named " + in_quotes(csv.text(column)));
  }
  return static_cast<int>(found - room.cameras.begin());
}

std::filesystem::path file_inside_folder(const CsvReader& csv, std::size_t column) {
  std::filesystem::path file(csv.text(column));
  if (file.is_absolute() || std::find(file.begin(), file.end(), "..") != file.end()) {
    csv.refuse(column,
               in_quotes(file.string()) + " leaves the folder; give a path relative to the sequence folder");
  }
  return file;
}

std::vector<SequenceFrame> read_frames(const std::filesystem::path& file, const RoomDescription& room) {
  using namespace frames_csv;
  CsvReader csv(file, {"frame", "t_s", "camera", "file"});
  std::vector<SequenceFrame> frames;
  std::unordered_set<std::uint32_t> numbers;
  RisingTime time;
  while (csv.next_row()) {
    SequenceFrame& row = frames.emplace_back();
    row.frame = csv.count(kFrame);
    if (!numbers.insert(row.frame).second) {
      csv.refuse(kFrame,
                 "frame " + std::to_string(row.frame) + " is there twice; every row needs its own number");
    }
    row.t_s = time.next(csv, kTime);
    row.camera = camera_named(csv, kCamera, room);
    row.file = file_inside_folder(csv, kFile);
    row.position = csv.position(kFile);
  }
  return frames;
}

CoilStatus read_status(const CsvReader& csv) {
  const auto found = std::find_if(kStatusWords.begin(), kStatusWords.end(),
                                  [&](const auto& row) { return row.first == csv.text(em_csv::kStatus); });
  if (found == kStatusWords.end()) {
    csv.refuse(em_csv::kStatus,
               in_quotes(csv.text(em_csv::kStatus)) + " is none of OK, MISSING, OUT_OF_VOLUME, DISABLED");
  }
  return found->second;
}

int read_sensor(const CsvReader& csv) {
  const std::uint32_t sensor = csv.count(em_csv::kSensor);
  if (sensor < 1 || sensor > static_cast<std::uint32_t>(kMaxTrackerCoils)) {
    csv.refuse(em_csv::kSensor, "sensor " + std::to_string(sensor) + " is not one of 1 .. " +
                                    std::to_string(kMaxTrackerCoils));
  }
  return static_cast<int>(sensor);
}

/// Three fields in a row; nothing when all are empty and may be.
std::optional<Eigen::Vector3d> read_vector(const CsvReader& csv, std::size_t first, bool may_be_empty) {
  if (may_be_empty && csv.is_empty(first) && csv.is_empty(first + 1) && csv.is_empty(first + 2)) {
    return std::nullopt;
  }
  return Eigen::Vector3d(csv.number(first), csv.number(first + 1), csv.number(first + 2));
}

/// Where the rotation takes +x: of a 5-DOF coil it means nothing. Not given: NaN.
Eigen::Vector3d read_x_axis(const CsvReader& csv, bool may_be_empty) {
  const bool empty = csv.is_empty(em_csv::kQw);
  if (may_be_empty && empty) {
    return CoilSample{}.x_axis_em;
  }
  const double w = csv.number(em_csv::kQw);
  const Eigen::Vector3d xyz(csv.number(em_csv::kQx), csv.number(em_csv::kQy), csv.number(em_csv::kQz));
  if (std::abs(std::hypot(w, xyz.norm()) - 1) > kUnitTolerance) {
    csv.refuse(em_csv::kQw, "the quaternion is not of length 1");
  }
  return Eigen::Quaterniond(w, xyz.x(), xyz.y(), xyz.z()).normalized() * Eigen::Vector3d::UnitX();
}

CoilSample read_coil(const CsvReader& csv) {
  CoilSample coil;
  coil.status = read_status(csv);
  const bool may_be_empty = coil.status != CoilStatus::kOk;
  if (const auto p_em_mm = read_vector(csv, em_csv::kX, may_be_empty)) {
    coil.p_em_mm = *p_em_mm;
  }
  if (const auto tangent_em = read_vector(csv, em_csv::kTx, may_be_empty)) {
    if (std::abs(tangent_em->norm() - 1) > kUnitTolerance) {
      csv.refuse(em_csv::kTx, "the tangent is not of length 1");
    }
    coil.tangent_em = tangent_em->normalized();
  }
  coil.x_axis_em = read_x_axis(csv, may_be_empty);
  coil.indicator = may_be_empty && csv.is_empty(em_csv::kError) ? 0 : csv.number(em_csv::kError);
  return coil;
}

std::vector<SequenceMeasurement> read_measurements(const std::filesystem::path& file) {
  CsvReader csv(file, {"t_s", "em_frame", "sensor", "status", "x", "y", "z", "tx", "ty", "tz", "qw", "qx",
                       "qy", "qz", "error"});
  std::vector<SequenceMeasurement> measurements;
  std::array<bool, kMaxTrackerCoils> seen{};
  RisingTime time;
  while (csv.next_row()) {
    const double t_s = time.next(csv, em_csv::kTime);
    const std::uint32_t em_frame = csv.count(em_csv::kFrame);
    if (measurements.empty() || measurements.back().t_s != t_s || measurements.back().em_frame != em_frame) {
      measurements.emplace_back();
      measurements.back().t_s = t_s;
      measurements.back().em_frame = em_frame;
      seen.fill(false);
    }
    SequenceMeasurement& measurement = measurements.back();
    const int sensor = read_sensor(csv);
    const auto coil = static_cast<std::size_t>(sensor - 1);
    if (std::exchange(seen[coil], true)) {
      csv.refuse(em_csv::kSensor, "sensor " + std::to_string(sensor) + " is there twice in one measurement");
    }
    measurement.coils[coil] = read_coil(csv);
    measurement.coil_count = std::max(measurement.coil_count, sensor);
  }
  return measurements;
}

template <std::size_t count>
std::array<double, count> read_numbers(const CsvReader& csv, std::size_t first) {
  std::array<double, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) {
    numbers[i] = csv.number(first + i);
  }
  return numbers;
}

ViewGeometry read_geometry(const CsvReader& csv, const CameraCalibration& camera) {
  using namespace geometry_csv;
  const ViewGeometry geometry{.fx = csv.number(kFx),
                              .fy = csv.number(kFy),
                              .cx = csv.number(kCx),
                              .cy = csv.number(kCy),
                              .q_camera_world = read_numbers<4>(csv, kQw),
                              .t_camera_world_mm = read_numbers<3>(csv, kX),
                              .sigma = {.rotation_rad = read_numbers<3>(csv, kSigmaRotation),
                                        .translation_mm = read_numbers<3>(csv, kSigmaTranslation),
                                        .pivot_depth_mm = csv.number(kPivotDepth)}};
  if (const char* const fault = refusal_of(geometry, camera)) {
    csv.refuse(kFrame, std::string("the geometry of this frame cannot be: ") + fault);
  }
  return geometry;
}

void read_geometries(const std::filesystem::path& file, const RoomDescription& room,
                     std::vector<SequenceFrame>& frames) {
  CsvReader csv(file, {"frame", "fx", "fy", "cx", "cy", "qw", "qx", "qy", "qz", "x", "y", "z", "sigma_rx",
                       "sigma_ry", "sigma_rz", "sigma_x", "sigma_y", "sigma_z", "pivot_depth"});
  std::unordered_map<std::uint32_t, SequenceFrame*> by_number;
  for (SequenceFrame& row : frames) {
    by_number.emplace(row.frame, &row);
  }
  while (csv.next_row()) {
    const std::uint32_t frame = csv.count(geometry_csv::kFrame);
    const auto found = by_number.find(frame);
    if (found == by_number.end() || found->second->geometry) {
      csv.refuse(geometry_csv::kFrame,
                 "frame " + std::to_string(frame) + " is not in frames.csv or had its geometry before");
    }
    SequenceFrame& row = *found->second;
    row.geometry = read_geometry(csv, room.cameras[static_cast<std::size_t>(row.camera)]);
  }
}

class TruthRows {
 public:
  explicit TruthRows(const std::vector<SequenceFrame>& frames) {
    for (const SequenceFrame& row : frames) {
      frames_.insert(row.frame);
    }
  }

  void take(const CsvReader& csv) {
    using namespace truth_csv;
    const std::uint32_t frame = csv.count(kFrame);
    if (shapes_.empty() || shapes_.back().frame != frame) {
      begin_shape(csv, frame);
    }
    if (std::abs(csv.number(kArcLength) - static_cast<double>(points_.size())) > kArcLengthTolerance_mm) {
      csv.refuse(kArcLength,
                 "expected " + std::to_string(points_.size()) + "; a centreline runs 0, 1, 2, ... mm");
    }
    points_.emplace_back(csv.number(kX), csv.number(kY), csv.number(kZ));
  }

  std::vector<SequenceTruth> finish() {
    end_shape();
    return std::move(shapes_);
  }

 private:
  void begin_shape(const CsvReader& csv, std::uint32_t frame) {
    if (frames_.erase(frame) == 0) {
      csv.refuse(truth_csv::kFrame,
                 "frame " + std::to_string(frame) + " is not in frames.csv or had its centreline before");
    }
    end_shape();
    shapes_.push_back({frame, {}});
  }

  void end_shape() {
    if (!shapes_.empty()) {
      shapes_.back().points_world_mm = Eigen::Map<const Eigen::Matrix3Xd>(
          points_.data()->data(), 3, static_cast<Eigen::Index>(points_.size()));
    }
    points_.clear();
  }

  std::unordered_set<std::uint32_t> frames_;  ///< without a centreline so far
  std::vector<Eigen::Vector3d> points_;       ///< of the last shape
  std::vector<SequenceTruth> shapes_;
};

std::vector<SequenceTruth> read_truth(const std::filesystem::path& file,
                                      const std::vector<SequenceFrame>& frames) {
  CsvReader csv(file, {"frame", "s_mm", "x", "y", "z"});
  TruthRows rows(frames);
  while (csv.next_row()) {
    rows.take(csv);
  }
  return rows.finish();
}

}  // namespace

Sequence read_sequence(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) {
    throw SequenceError({folder}, "is not a folder; give the folder that holds sequence.toml");
  }
  Sequence sequence;
  sequence.folder = folder;
  read_sequence_description(folder / "sequence.toml", sequence);
  sequence.frames = read_frames(folder / "frames.csv", sequence.room);
  if (std::filesystem::exists(folder / "geometry.csv")) {
    read_geometries(folder / "geometry.csv", sequence.room, sequence.frames);
  }
  sequence.measurements = read_measurements(folder / "em.csv");
  if (std::filesystem::exists(folder / "truth.csv")) {
    sequence.truth = read_truth(folder / "truth.csv", sequence.frames);
  }
  return sequence;
}

CameraCalibration camera_of(const Sequence& sequence, const SequenceFrame& frame) {
  CameraCalibration camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
  if (frame.geometry) {
    camera.look_from(*frame.geometry);
  }
  return camera;
}

const SequenceTruth* find_truth(const Sequence& sequence, std::uint32_t frame) {
  const auto found = std::find_if(sequence.truth.begin(), sequence.truth.end(),
                                  [&](const SequenceTruth& shape) { return shape.frame == frame; });
  return found == sequence.truth.end() ? nullptr : &*found;
}

std::string_view status_word(CoilStatus status) {
  return std::find_if(kStatusWords.begin(), kStatusWords.end(),
                      [&](const auto& row) { return row.second == status; })
      ->first;
}

}  // namespace tubed
