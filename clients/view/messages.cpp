#include "clients/view/messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "idl/printable_text.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

using nlohmann::json;

double milliseconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

/// Fewer digits: a picture needs no more, and a message has a thousand of them.
json rounded(double value, double step) {
  return std::isfinite(value) ? json(std::round(value / step) * step) : json();
}

json micrometres(double mm) {
  // A power of ten that is divided by prints shortest.
  return std::isfinite(mm) ? json(std::round(mm * 1e3) / 1e3) : json();
}

json names_of_bits(std::uint32_t bits) {
  json names = json::array();
  for (int bit = 0; bit < kReasonCount; ++bit) {
    const auto reason = static_cast<Reason>(1U << static_cast<unsigned>(bit));
    if (Reasons(bits).has(reason)) names.push_back(name_of(reason));
  }
  return names;
}

template <typename Element, std::size_t size>
std::span<const Element> used(const Element (&array)[size], std::uint32_t count) {
  return std::span(array).first(std::min<std::size_t>(count, size));
}

json stage_json(const tubed_StageStatus& stage) {
  constexpr std::array<const char*, 6> kStates{"starting",     "running", "degraded",
                                               "reconnecting", "ended",   "failed"};
  return {{"name", printable_text(stage.name)},
          {"state", stage.state < kStates.size() ? kStates.at(stage.state) : "unknown"},
          {"why", printable_text(stage.why)}};
}

json instrument_json(const tubed_TubeIdentity& identity) {
  json object{{"id", printable_text(identity.instrument_id)},
              {"mode", printable_text(identity.mode)},
              {"diameter", identity.diameter_mm},
              {"length", identity.length_mm},
              {"frame", printable_text(identity.world_frame)},
              {"axes", printable_text(identity.world_axes)},
              {"software", printable_text(identity.software_version)},
              {"residual", micrometres(identity.registration_residual_mm)}};
  for (const double value : identity.T_world_em) object["T_world_em"].push_back(value);
  json& cameras = object["cameras"] = json::array();
  for (const tubed_CameraIdentity& camera : used(identity.cameras, identity.camera_count)) {
    cameras.push_back(printable_text(camera.name));
  }
  return object;
}

json camera_json(const tubed_CameraIdentity& camera) {
  json object{{"name", printable_text(camera.name)},
              {"width", camera.width},
              {"height", camera.height},
              {"f", {camera.focal_length_px[0], camera.focal_length_px[1]}},
              {"c", {camera.principal_point_px[0], camera.principal_point_px[1]}}};
  for (const double value : camera.distortion) object["distortion"].push_back(value);
  for (const double value : camera.T_camera_world) object["T_camera_world"].push_back(value);
  return object;
}

json coil_json(const tubed_EmCoil& coil, const double* T) {
  json object{{"status", coil.status}};
  for (int row = 0; row < 3; ++row) {
    const double* const r = T + std::ptrdiff_t{4} * row;
    const auto turned = [&](const double* v) { return r[0] * v[0] + r[1] * v[1] + r[2] * v[2]; };
    object["p"].push_back(micrometres(turned(coil.p_em_mm) + r[3]));
    object["t"].push_back(rounded(turned(coil.tangent_em), 1e-4));
  }
  return object;
}

json residual_json(const tubed_CoilResidual& coil) {
  return {{"state", coil.state},
          {"s", micrometres(coil.offset_from_tip_mm)},
          {"mm", micrometres(coil.position_mm)},
          {"rad", rounded(coil.angle_rad, 1e-4)}};
}

void add_points(const tubed_TubeEstimate& estimate, json& object) {
  json& points = object["points"] = json::array();
  json& covariances = object["cov"] = json::array();
  json& held = object["held"] = json::array();
  for (const tubed_CentrelinePoint& point : used(estimate.points, estimate.point_count)) {
    for (const double value : point.p_world_mm) points.push_back(micrometres(value));
    for (const float value : point.covariance_mm2) {
      covariances.push_back(std::isfinite(value) ? json(std::round(double{value} * 1e4) / 1e4) : json());
    }
    held.push_back(point.held_by);
  }
}

json view_json(const tubed_ViewUsed& view) {
  json object{{"camera", view.camera},
              {"f", {view.focal_length_px[0], view.focal_length_px[1]}},
              {"c", {view.principal_point_px[0], view.principal_point_px[1]}}};
  for (const double value : view.T_camera_world) object["T_camera_world"].push_back(value);
  return object;
}

/// Exposure to dds_write, of a sample with an image of its very instant; null: no such image.
json latency_json(const tubed_TubeEstimate& estimate) {
  const tubed_StageStamps& stamps = estimate.stamps;
  const bool is_known = estimate.has_image && stamps.exposure_monotonic_ns > 0;
  return is_known ? json(milliseconds(stamps.publish_started_monotonic_ns - stamps.exposure_monotonic_ns))
                  : json();
}

MarkerAxes world_axes_of(const RoomKnowledge& room) {
  for (const auto& [id, identity] : room.identities) {
    for (const MarkerAxes axes : {MarkerAxes::kLps, MarkerAxes::kRas}) {
      if (identity.world_axes == name_of(axes)) return axes;
    }
  }
  return MarkerAxes::kAsWritten;
}

json point_json(const double* p_mm) {
  return {micrometres(p_mm[0]), micrometres(p_mm[1]), micrometres(p_mm[2])};
}

/// Where the marker of that name was touched, in the world; null: nowhere, or no registration is known.
json touched_json(const RoomKnowledge& room, const std::string& name) {
  const std::vector<Marker>& touched = room.files.touched.markers;
  const auto found =
      std::find_if(touched.begin(), touched.end(), [&](const Marker& marker) { return marker.name == name; });
  if (found == touched.end() || room.identities.empty()) return {};
  using Transform = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const Eigen::Map<const Transform> T_world_em(room.identities.begin()->second.T_world_em);
  const Eigen::Vector3d p_world_mm =
      T_world_em.topLeftCorner<3, 3>() * found->p_mm + T_world_em.topRightCorner<3, 1>();
  return point_json(p_world_mm.data());
}

void add_files(const RoomKnowledge& room, json& object) {
  const VesselNote& vessel = room.files.vessel;
  const MarkerAxes axes = world_axes_of(room);
  object["vessel"] =
      vessel.kind.empty()
          ? json()
          : json{{"name", printable_text(vessel.name)}, {"kind", vessel.kind}, {"size", vessel.size}};
  object["axes"] = axes == MarkerAxes::kAsWritten ? "" : name_of(axes);
  json& points = object["points"] = json::array();
  for (const Marker& marker : along(room.files.points, axes).markers) {
    points.push_back({{"name", printable_text(marker.name)}, {"p", point_json(marker.p_mm.data())}});
    if (json touched = touched_json(room, marker.name); !touched.is_null()) {
      points.back()["touched"] = std::move(touched);
    }
  }
}

}  // namespace

json room_json(const RoomKnowledge& room) {
  json object{{"type", "room"},           {"version", TUBED_VERSION}, {"instruments", json::array()},
              {"cameras", json::array()}, {"stages", json::object()}, {"images", room.image_cameras},
              {"demo", json::array()}};
  std::map<std::string, json> cameras;
  for (const auto& [id, identity] : room.identities) {
    object["instruments"].push_back(instrument_json(identity));
    for (const tubed_CameraIdentity& camera : used(identity.cameras, identity.camera_count)) {
      cameras[printable_text(camera.name)] = camera_json(camera);
    }
  }
  for (const auto& [name, camera] : cameras) object["cameras"].push_back(camera);
  for (const auto& [id, status] : room.statuses) {
    json& stages = object["stages"][id] = json::array();
    for (const tubed_StageStatus& stage : used(status.stages, status.stage_count))
      stages.push_back(stage_json(stage));
  }
  for (const DemoCommand& command : room.demo_commands) {
    object["demo"].push_back({{"name", command.name}, {"label", command.label}});
  }
  add_files(room, object);
  return object;
}

json estimate_json(const tubed_TubeEstimate& estimate, std::int64_t received_ns, const tubed_EmSamples* coils,
                   const double* T_world_em) {
  json object{{"type", "estimate"},
              {"instrument", printable_text(estimate.instrument_id)},
              {"seq", estimate.sequence_number},
              {"start", std::to_string(estimate.daemon_start)},
              {"received", milliseconds(received_ns)},
              {"published_at", milliseconds(estimate.publish_time_ns)},
              {"valid_at", milliseconds(estimate.valid_time_monotonic_ns)},
              {"validity", name_of(static_cast<Validity>(estimate.validity))},
              {"reasons", names_of_bits(estimate.reasons)},
              {"has_image", estimate.has_image},
              {"image_frame", estimate.image_frame},
              {"em_age", estimate.em_age_ns == -1 ? json() : json(milliseconds(estimate.em_age_ns))},
              {"image_age", estimate.image_age_ns == -1 ? json() : json(milliseconds(estimate.image_age_ns))},
              {"radius", micrometres(estimate.radius_mm)},
              {"length", micrometres(estimate.length_mm)},
              {"inliers", rounded(estimate.image_inlier_ratio, 1e-3)},
              {"in_view", rounded(estimate.in_view_ratio, 1e-3)},
              {"exposed_at", milliseconds(estimate.stamps.exposure_monotonic_ns)},
              {"latency", latency_json(estimate)},
              {"coils", json::array()},
              {"views", json::array()}};
  add_points(estimate, object);
  for (const tubed_ViewUsed& view : used(estimate.views, estimate.view_count)) {
    object["views"].push_back(view_json(view));
  }
  for (const tubed_CoilResidual& coil : used(estimate.coils, estimate.coil_count)) {
    object["coils"].push_back(residual_json(coil));
  }
  if (coils != nullptr && T_world_em != nullptr) {
    object["em_origin"] = coils->origin;
    for (const tubed_EmCoil& coil : used(coils->coils, coils->coil_count)) {
      object["em"].push_back(coil_json(coil, T_world_em));
    }
  }
  return object;
}

}  // namespace tubed
