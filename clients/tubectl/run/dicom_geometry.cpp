#include "clients/tubectl/run/dicom_geometry.hpp"

#ifdef TUBED_READS_DICOM_RUNS

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "clients/calibration/dicom/xa_header.hpp"
#include "daemon/config/load_configuration.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr double kSigmaOfWhole_deg = 0.3;  // 1 / sqrt(12)
constexpr double kSigmaOfTenths_deg = 0.1;

/// A camera of a configuration and the C-arm that it stands on.
struct PlacedCamera {
  CameraCalibration camera;
  CArm c_arm;
};

PlacedCamera placed_camera(const std::string& file, const std::string& name) {
  const Configuration configuration = load_configuration(file);
  const auto& cameras = configuration.room.cameras;
  const auto found = std::find_if(cameras.begin(), cameras.end(),
                                  [&](const CameraCalibration& camera) { return camera.name == name; });
  if (found == cameras.end()) {
    throw std::runtime_error(file + " has no camera '" + name + "': give --camera one of its names");
  }
  const auto& c_arm = configuration.c_arms[static_cast<std::size_t>(found - cameras.begin())];
  if (!c_arm) {
    throw std::runtime_error(
        file + ": camera '" + name +
        "' has no [camera.c_arm], whose angles a run could turn; `tubectl geometry xa` makes one");
  }
  if (found->geometry == GeometryUse::kConfiguration) {
    throw std::runtime_error(file + ": geometry of camera '" + name +
                             "' is \"configuration\", which leaves out what images bring: write \"image\" or "
                             "\"required\", or leave out --config");
  }
  return {*found, *c_arm};
}

void tell_difference(const char* key, double run, double configured, std::vector<std::string>& remarks) {
  if (std::abs(run - configured) > 1e-3 * std::abs(configured)) {
    std::ostringstream words;
    words << key << " is " << run << " in the run and " << configured
          << " in the configuration: the run's is used";
    remarks.push_back(words.str());
  }
}

/// The value of a key of [camera.c_arm] that the configuration could have as well.
bool is_possible(const char* key, double value) {
  for (const BoundKey<CArm>& bound : c_arm_keys()) {
    if (bound.key.name == key) return value >= bound.key.minimum && value <= bound.key.maximum;
  }
  return false;
}

/// What a file states beside the angles, each by itself, in place of the configuration's.
void take_stated(const XaHeader& header, CArm& c_arm, std::vector<std::string>& remarks) {
  const CArm configured = c_arm;
  const auto take = [&](const char* attribute, const char* key, double& value) {
    const XaAttribute& stated = header.attribute(attribute);
    if (!stated.is_there()) return;
    const double found = stated.values.back();  // of spacings the columns'
    if (is_possible(key, found)) {
      tell_difference(key, found, value, remarks);
      value = found;
    } else {
      remarks.push_back(std::string(attribute) + " of the run is " + std::to_string(found) + " " +
                        stated.unit + ", which no C-arm has: the configuration's " + key + " is used");
    }
  };
  take("DistanceSourceToDetector", "source_detector_mm", c_arm.source_detector_mm);
  take("DistanceSourceToIsocenter", "source_isocentre_mm", c_arm.source_isocentre_mm);
  if (c_arm.source_isocentre_mm >= c_arm.source_detector_mm) {
    remarks.emplace_back(
        "with the run's distances the isocentre is not nearer the source than the detector: the "
        "configuration's are used");
    c_arm.source_isocentre_mm = configured.source_isocentre_mm;
    c_arm.source_detector_mm = configured.source_detector_mm;
  }
  take("ImagerPixelSpacing", "pixel_pitch_mm", c_arm.pixel_pitch_mm);
  if (header.attribute("ImagerPixelSpacing").is_there() && header.c_arm) {
    tell_difference("zoom", header.c_arm->zoom, c_arm.zoom, remarks);
    c_arm.zoom = header.c_arm->zoom;
  }
}

/// The run's images have to be those that the configuration's camera describes, and that camera the C-arm's
/// own.
void check_camera(const PlacedCamera& placed, const DicomRun& run, const std::string& file) {
  const CameraCalibration& camera = placed.camera;
  if (camera.width != run.width || camera.height != run.height) {
    throw std::runtime_error(file + ": camera '" + camera.name + "' is " + std::to_string(camera.width) +
                             " x " + std::to_string(camera.height) + " px, the run " +
                             std::to_string(run.width) + " x " + std::to_string(run.height) +
                             ": expected the same, or leave out --config");
  }
  CameraCalibration by_c_arm = camera;
  place(placed.c_arm, by_c_arm);
  constexpr double kSame = 1e-9;
  if (std::abs(by_c_arm.fx / camera.fx - 1) > kSame ||
      !by_c_arm.T_camera_world.isApprox(camera.T_camera_world, kSame)) {
    throw std::runtime_error(
        file + ": the driver of camera '" + camera.name +
        "' changes its pictures (decimation, rotation), which a run's are without: write a "
        "configuration for the run");
  }
}

double sigma_deg(const XaHeader& header) {
  const auto is_whole = [](const GantryAngles& angles) {
    return angles.primary_deg == std::round(angles.primary_deg) &&
           angles.secondary_deg == std::round(angles.secondary_deg);
  };
  return std::all_of(header.angles.begin(), header.angles.end(), is_whole) ? kSigmaOfWhole_deg
                                                                           : kSigmaOfTenths_deg;
}

ViewGeometry geometry_at(const PlacedCamera& placed, const XaHeader& header, int frame) {
  const GantryAngles& angles = header.angles[static_cast<std::size_t>(frame)];
  CArm c_arm = placed.c_arm;
  c_arm.primary_angle_deg = angles.primary_deg;
  c_arm.secondary_angle_deg = angles.secondary_deg;
  CameraCalibration camera = placed.camera;
  place(c_arm, camera);
  ViewGeometry geometry = geometry_of(camera);
  geometry.sigma.rotation_rad.fill(sigma_deg(header) * kDegree);
  geometry.sigma.pivot_depth_mm = c_arm.source_isocentre_mm;
  if (const char* const fault = refusal_of(geometry, placed.camera)) {
    throw std::runtime_error(header.file + ": image " + std::to_string(frame + 1) + ": " + fault);
  }
  return geometry;
}

void add_once(const std::vector<std::string>& words, std::vector<std::string>& remarks) {
  for (const std::string& word : words) {
    if (std::find(remarks.begin(), remarks.end(), word) == remarks.end()) remarks.push_back(word);
  }
}

}  // namespace

DicomGeometries geometries_of(const DicomRun& run, const std::string& config, const std::string& camera) {
  const PlacedCamera configured = placed_camera(config, camera);
  check_camera(configured, run, config);
  DicomGeometries geometries;
  geometries.of_frames.resize(run.frames.size());
  for (std::size_t file = 0; file < run.files.size(); ++file) {
    const XaHeader header = read_xa_header(run.files[file]);
    if (header.angles.empty()) {
      add_once({"images of files that state no angles have no poses"}, geometries.remarks);
      continue;
    }
    PlacedCamera placed = configured;
    std::vector<std::string> taken;
    take_stated(header, placed.c_arm, taken);
    add_once(taken, geometries.remarks);
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
      const DicomFrame& frame = run.frames[i];
      if (frame.file == file && static_cast<std::size_t>(frame.number_in_file) < header.angles.size()) {
        geometries.of_frames[i] = geometry_at(placed, header, frame.number_in_file);
      }
    }
  }
  return geometries;
}

}  // namespace tubed

#endif
