#include "bench/peers/sample_estimate.hpp"

#include <cmath>
#include <cstring>

#include "daemon/publishing/wire_conversion.hpp"

namespace tubed {

TubeEstimate sample_estimate() {
  TubeEstimate estimate;
  estimate.validity = Validity::kValid;
  estimate.has_image = true;
  estimate.radius_mm = 1.165F;
  estimate.length_mm = 380;
  estimate.point_count = kMaxCentrelinePoints;
  for (std::size_t i = 0; i < estimate.points.size(); ++i) {
    const double angle = static_cast<double>(i) / 40;
    estimate.points[i].p_world_mm = {120 * std::cos(angle), 120 * std::sin(angle), 0};
    estimate.points[i].tangent_world = {static_cast<float>(-std::sin(angle)),
                                        static_cast<float>(std::cos(angle)), 0};
    estimate.points[i].covariance_mm2 = {0.2F, 0, 0, 0.2F, 0, 2};
  }
  estimate.coefficient_count = 26;
  estimate.coil_count = 5;
  return estimate;
}

void fill(tubed_TubeEstimate& wire) {
  to_wire(sample_estimate(), read_clocks(), wire);
  std::strcpy(wire.instrument_id, "cath-1");
}

}  // namespace tubed
