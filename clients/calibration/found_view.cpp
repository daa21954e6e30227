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

std::vector<double> rounded_list(const std::array<float, 3>& values, double unit) {
  std::vector<double> list;
  for (const float value : values) list.push_back(rounded(static_cast<double>(value) / unit, 1e4));
  return list;
}

}  // namespace

std::optional<FoundView> found_view_in(const TubeEstimate& estimate, const RoomDescription& room,
                                       const std::string& camera) {
  if (!estimate.reasons.has(Reason::kGeometryChanged)) return std::nullopt;
  std::optional<FoundView> found;
  for (std::size_t i = 0; i < estimate.view_count; ++i) {
    const ViewUsed& view = estimate.views[i];
    const CameraCalibration& configured = room.cameras.at(view.camera);
    if (!view.has_own_geometry || (!camera.empty() && camera != configured.name)) continue;
    if (found) {
      throw CalibrationError(
          "cameras " + found->camera + " and " + configured.name +
          " have poses of their own: say with --camera which of them moved without a word");
    }
    found = FoundView{configured.name, view, view.focal_length_px[0] / configured.fx};
  }
  return found;
}

// A view that is lost for a moment is found again; one that is lost for longer has moved on.
void FoundViewSearch::take(const TubeEstimate& estimate) {
  constexpr std::int64_t kLost_ns = 1'000'000'000;
  if (estimate.reasons.has(Reason::kImageOff)) return;
  has_moved_ = has_moved_ || estimate.reasons.has(Reason::kGeometryChanged);
  if (auto view = found_view_in(estimate, room_, camera_)) {
    found_ = std::move(view);
    found_ns_ = estimate.valid_time_ns;
  } else if (!estimate.reasons.has(Reason::kGeometryChanged) ||
             estimate.valid_time_ns - found_ns_ > kLost_ns) {
    found_.reset();
  }
}

FoundView find_view(const ConfiguredSequence& run, const std::string& camera) {
  if (run.estimator.mode != EstimatorMode::kFilter) {
    throw CalibrationError("mode \"" + std::string(name_of(run.estimator.mode)) +
                           "\" does not look for a view that moved: mode = \"filter\" does");
  }
  FoundViewSearch search(run.sequence.room, camera);
  reconstruct(
      run.sequence, run.estimator, run.frangi,
      [&](const SequenceInstant&, const TubeEstimate& estimate) { search.take(estimate); },
      run.max_image_timeout);
  if (search.found()) return *search.found();
  throw CalibrationError(search.has_moved()
                             ? "the view moved, and where it stands at the end was not found, or it is back: "
                               "keep the catheter in view, "
                               "moving, for twenty seconds after the C-arm or the table has come to rest"
                             : "no view moved without a pose of its own: there is nothing to be found");
}

ConfigurationFragment fragment_of(const FoundView& found) {
  const ViewUsed& view = found.view;
  ConfigurationFragment fragment{"tubectl calibrate view", date_of_today(), {}, {}};
  const std::string table = "camera[" + found.camera + "]";
  Eigen::Matrix4d T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(view.T_camera_world.data());
  for (double& entry : T.reshaped()) entry = rounded(entry, 1e9);
  const auto sigma_mm = rounded_list(view.sigma_translation_mm, 1);
  const auto sigma_deg = rounded_list(view.sigma_rotation_rad, kDegree);
  fragment.remarks.push_back(
      formatted("found from coils and images after a move that no pose announced: known to %.1f mm an axis "
                "across the view",
                std::hypot(sigma_mm[0], sigma_mm[1]) / std::sqrt(2.0)));
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
