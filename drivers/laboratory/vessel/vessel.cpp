#include "drivers/laboratory/vessel/vessel.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

double distance_mm(const VesselStation& a, const VesselStation& b) {
  return (a.p_world_mm - b.p_world_mm).norm();
}

}  // namespace

double Vessel::route_length_mm() const {
  double length = 0;
  for (std::size_t i = 1; i < route.size(); ++i) {
    length += distance_mm(route[i - 1], route[i]);
  }
  return length;
}

Eigen::Vector3d Vessel::route_point(double u_mm) const {
  double left = std::max(0.0, u_mm);
  for (std::size_t i = 1; i < route.size(); ++i) {
    const double piece = distance_mm(route[i - 1], route[i]);
    if (left <= piece && piece > 0) {
      return route[i - 1].p_world_mm + left / piece * (route[i].p_world_mm - route[i - 1].p_world_mm);
    }
    left -= piece;
  }
  return route.back().p_world_mm;
}

void append_tube(const std::vector<VesselStation>& stations, std::vector<LumenBall>& balls) {
  constexpr double kMaxGap_mm = 0.7;
  for (std::size_t i = 0; i + 1 < stations.size(); ++i) {
    const double gap = distance_mm(stations[i], stations[i + 1]);
    const int pieces = std::max(1, static_cast<int>(std::ceil(gap / kMaxGap_mm)));
    for (int piece = 0; piece < pieces; ++piece) {
      const double part = static_cast<double>(piece) / pieces;
      balls.push_back({(1 - part) * stations[i].p_world_mm + part * stations[i + 1].p_world_mm,
                       (1 - part) * stations[i].radius_mm + part * stations[i + 1].radius_mm});
    }
  }
  if (!stations.empty()) {
    balls.push_back({stations.back().p_world_mm, stations.back().radius_mm});
  }
}

}  // namespace tubed
