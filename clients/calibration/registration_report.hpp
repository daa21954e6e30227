// A judged registration as values of the configuration, as a page and as numbers for machines.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/registration_findings.hpp"

namespace tubed {

/// A point of the world at which the registration is asked for its error.
struct Target {
  std::string name;
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
};

/// A place along a tube.
struct TubePlace {
  double s_mm = 0;  ///< from the tip
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
};

/// What the registration was made of, beside the markers.
struct RegistrationContext {
  MarkerAxes world_axes = MarkerAxes::kAsWritten;  ///< of the world that results
  std::string date;
  std::vector<std::string> remarks;  ///< files, what was left out
  std::vector<Target> targets;
  std::vector<TubePlace> tube;  ///< tip first; empty: not given
};

/// em.T_world_em, its residual (FRE), covariance, centre and date; dds.world_axes where the axes are known.
ConfigurationFragment fragment_of(const JudgedRegistration& judged, const RegistrationContext& context);

/// Residuals, findings, markers in two projections, table, expected errors.
std::string page_of(const JudgedRegistration& judged, const RegistrationContext& context);

/// For machines: findings, markers, FRE, FLE, transform, expected errors. Transform and errors are left out
/// where a finding is bad.
nlohmann::json to_json(const JudgedRegistration& judged, const RegistrationContext& context);

/// A table of markers and of targets, a line each.
std::string to_text(const JudgedRegistration& judged, const RegistrationContext& context);

/// Findings, a line each and their advice below: "fine  units  ...".
std::string to_text(const std::vector<CalibrationFinding>& findings);
nlohmann::json to_json(const std::vector<CalibrationFinding>& findings);

}  // namespace tubed
