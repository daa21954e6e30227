#include "clients/calibration/found_view.hpp"

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/formatted.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr double kSameFocal = 1e-6;  // relative

double rounded(double value, double scale) { return std::round(value * scale) / scale; }

std::vector<double> list_of(const std::array<float, 3>& values, double unit) {
  std::vector<double> list;
  for (const float value : values) list.push_back(rounded(static_cast<double>(value) / unit, 1e4));
  return list;
}

}  // namespace

std::optional<FoundView> found_view_in(const TubeEstimate& estimate, const RoomDescription& room,
                                       const std::string& camera) {
  if (!estimate.reasons.has(Reason::kGeometryChanged)) return std::nullopt;
  for (std::size_t i = 0; i < estimate.view_count; ++i) {
    const ViewUsed& view = estimate.views[i];
    const CameraCalibration& configured = room.cameras.at(view.camera);
    if (view.has_own_geometry && (camera.empty() || camera == configured.name)) {
      return FoundView{configured.name, view, view.focal_length_px[0] / configured.fx};
    }
  }
  return std::nullopt;
}

FoundView find_view(const ConfiguredSequence& run, const std::string& camera) {
  std::optional<FoundView> found;
  bool has_moved = false;
  reconstruct(
      run.sequence, run.estimator, run.frangi,
      [&](const SequenceInstant&, const TubeEstimate& estimate) {
        has_moved = has_moved || estimate.reasons.has(Reason::kGeometryChanged);
        if (const auto view = found_view_in(estimate, run.sequence.room, camera)) found = view;
      },
      run.max_image_timeout);
  if (found) return *found;
  throw CalibrationError(
      has_moved ? "the view moved, and where to was not found: keep the catheter in view, moving, for twenty "
                  "seconds after the C-arm or the table has come to rest"
                : "no view moved without a pose of its own: there is nothing to be found");
}

ConfigurationFragment fragment_of(const FoundView& found) {
  const ViewUsed& view = found.view;
  ConfigurationFragment fragment{"tubectl calibrate view", date_of_today(), {}, {}};
  const std::string table = "camera[" + found.camera + "]";
  Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(view.T_camera_world.data());
  for (double& entry : T.reshaped()) entry = rounded(entry, 1e9);
  const auto sigma_mm = list_of(view.sigma_translation_mm, 1);
  const auto sigma_deg = list_of(view.sigma_rotation_rad, kDegree);
  fragment.remarks.push_back(formatted(
      "found from coils and images after a move that no pose announced: known to %.1f mm across the view",
      std::hypot(sigma_mm[0], sigma_mm[1])));
  if (std::abs(found.focal_ratio - 1) > kSameFocal) {
    fragment.remarks.push_back(formatted("the magnification is %.3f of what it was", found.focal_ratio));
    fragment.values.push_back({table + ".fx", rounded(view.focal_length_px[0], 1e3)});
    fragment.values.push_back({table + ".fy", rounded(view.focal_length_px[1], 1e3)});
  }
  fragment.values.push_back({table + ".T_camera_world", T});
  fragment.values.push_back({table + ".pose_sigma_mm", sigma_mm});
  fragment.values.push_back({table + ".pose_sigma_deg", sigma_deg});
  return fragment;
}

}  // namespace tubed
