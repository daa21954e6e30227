// Estimates every 1 mm from the tip: as what is judged, and as rows of a file that estimates_csv.hpp reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <ostream>

#include "clients/evaluation/estimates_csv.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// The centreline from the spline, covariances interpolated between the points; empty without a shape.
EstimatedShape shape_of(const TubeEstimate& estimate);

/// Coefficients of the spline as a matrix, 3 x coefficient_count, mm, world.
Eigen::Matrix3Xd coefficients_of(const TubeEstimate& estimate);

/// CentrelinePoint::held_by of the published point that is nearest to s_mm. Precondition: there is a shape.
std::uint32_t held_by_at(const TubeEstimate& estimate, double s_mm);

/// The header line.
void write_estimate_header(std::ostream& out);

/// All rows of one estimate, shape_of() it, under `frame`. An estimate without a shape becomes one row with
/// the frame and the validity alone, so that nothing is lost.
void write_estimate_rows(std::ostream& out, std::uint32_t frame, const TubeEstimate& estimate);

}  // namespace tubed
