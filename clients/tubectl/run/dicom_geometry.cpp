#include "clients/tubectl/run/dicom_geometry.hpp"

#ifdef TUBED_READS_DICOM_RUNS

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "clients/calibration/dicom/xa_header.hpp"
#include "daemon/config/load_configuration.hpp"

namespace tubed {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
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

/// What a file states beside the angles, in place of the configuration's.
void take_stated(const XaHeader& header, CArm& c_arm, std::vector<std::string>& remarks) {
  if (!header.c_arm) {
    return;
  }
  const auto take = [&](const char* attribute, const char* key, double stated, double& value) {
    if (header.attribute(attribute).is_there()) {
      tell_difference(key, stated, value, remarks);
      value = stated;
    }
  };
  take("DistanceSourceToDetector", "source_detector_mm", header.c_arm->source_detector_mm,
       c_arm.source_detector_mm);
  take("DistanceSourceToIsocenter", "source_isocentre_mm", header.c_arm->source_isocentre_mm,
       c_arm.source_isocentre_mm);
  take("ImagerPixelSpacing", "pixel_pitch_mm", header.c_arm->pixel_pitch_mm, c_arm.pixel_pitch_mm);
  take("ImagerPixelSpacing", "zoom", header.c_arm->zoom, c_arm.zoom);
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
  DicomGeometries geometries;
  geometries.of_frames.resize(run.frames.size());
  for (std::size_t file = 0; file < run.files.size(); ++file) {
    const XaHeader header = read_xa_header(run.files[file]);
    if (header.angles.empty()) {
      geometries.remarks.push_back(run.files[file].string() +
                                   " states no angles: its images are sent without poses");
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
