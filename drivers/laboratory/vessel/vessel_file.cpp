#include "drivers/laboratory/vessel/vessel_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <queue>
#include <sstream>
#include <stdexcept>
#include <string>

#include "drivers/laboratory/vessel/surface_mesh.hpp"

namespace tubed {

namespace {

constexpr double kMinRadius_mm = 1.5;
constexpr double kMaxGap_mm = 10;
constexpr double kMinLength_mm = 30;
constexpr double kMaxLength_mm = 3000;
constexpr double kStraight_mm = 5;
constexpr double kMaxKink = 0.5;  ///< cosine

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw std::invalid_argument(where + ": " + what);
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) {
    field.erase(0, field.find_first_not_of(" \t\r"));
    field.erase(field.find_last_not_of(" \t\r") + 1);
    fields.push_back(field);
  }
  return fields;
}

double number_in(const std::vector<std::string>& fields, std::size_t column, const std::string& where) {
  char* end = nullptr;
  const double value = column < fields.size() ? std::strtod(fields[column].c_str(), &end) : 0;
  if (column >= fields.size() || fields[column].empty() || *end != 0 || !std::isfinite(value)) {
    refuse(where, "column " + std::to_string(column + 1) + " is no number; give x, y, z and radius in mm");
  }
  return value;
}

std::vector<VesselStation> read_centreline(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line)) {
    refuse(file.string(), "cannot be read or is empty; does it exist?");
  }
  const std::vector<std::string> header = fields_of(line);
  std::array<std::size_t, 4> columns{};
  constexpr std::array<const char*, 4> kNames{"x", "y", "z", "radius"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto found = std::find(header.begin(), header.end(), kNames[i]);
    if (found == header.end()) {
      refuse(file.string() + ":1",
             std::string("has no column '") + kNames[i] + "'; the header is x,y,z,radius");
    }
    columns[i] = static_cast<std::size_t>(found - header.begin());
  }
  std::vector<VesselStation> stations;
  for (int number = 2; std::getline(stream, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) {
      continue;
    }
    const std::string where = file.string() + ":" + std::to_string(number);
    const std::vector<std::string> fields = fields_of(line);
    VesselStation station;
    for (int axis = 0; axis < 3; ++axis) {
      station.p_world_mm[axis] = number_in(fields, columns[static_cast<std::size_t>(axis)], where);
    }
    station.radius_mm = number_in(fields, columns[3], where);
    if (!(station.radius_mm >= kMinRadius_mm) || station.radius_mm > 100) {
      refuse(where, "radius " + fields[columns[3]] +
                        " is no lumen for a catheter; radii are 1.5 to 100 mm (is it in m?)");
    }
    const double gap = stations.empty() ? 1 : (station.p_world_mm - stations.back().p_world_mm).norm();
    if (gap > kMaxGap_mm) {
      refuse(where, "is " + std::to_string(gap) + " mm from the row before; give a row every 10 mm at least");
    }
    if (gap > 1e-6) {
      stations.push_back(station);
    }
  }
  return stations;
}

void check_route(const std::vector<VesselStation>& route, const std::string& name) {
  double length = 0;
  for (std::size_t i = 1; i < route.size(); ++i) {
    length += (route[i].p_world_mm - route[i - 1].p_world_mm).norm();
  }
  if (length < kMinLength_mm || length > kMaxLength_mm) {
    refuse(name, "the way through it is " + std::to_string(length) +
                     " long; a vessel in mm is 30 to 3000 (is it in m or cm? Scale it to mm)");
  }
  for (std::size_t i = 2; i < route.size(); ++i) {
    const Eigen::Vector3d before = (route[i - 1].p_world_mm - route[i - 2].p_world_mm).normalized();
    const Eigen::Vector3d after = (route[i].p_world_mm - route[i - 1].p_world_mm).normalized();
    if (before.dot(after) < kMaxKink) {
      std::ostringstream text;
      text << "the centreline turns by more than 60 deg at (" << route[i - 1].p_world_mm.transpose()
           << "); smooth it or put its rows in order";
      refuse(name, text.str());
    }
  }
}

/// The introducer at the beginning of a route, along its first few mm.
Introducer introducer_of(const std::vector<VesselStation>& route) {
  std::size_t ahead = 1;
  while (ahead + 1 < route.size() && (route[ahead].p_world_mm - route[0].p_world_mm).norm() < kStraight_mm) {
    ++ahead;
  }
  const Eigen::Vector3d direction = (route[ahead].p_world_mm - route[0].p_world_mm).normalized();
  return {route[0].p_world_mm, direction, direction.unitOrthogonal()};
}

Vessel vessel_along(std::vector<VesselStation> route) {
  const Introducer introducer = introducer_of(route);
  std::vector<VesselStation> lumen = route;
  constexpr double kOutside_mm = 25;
  lumen.insert(lumen.begin(), {route[0].p_world_mm - kOutside_mm * introducer.direction, route[0].radius_mm});
  std::vector<LumenBall> balls;
  append_tube(lumen, balls);
  return {WallField::of_balls(balls), introducer, std::move(route)};
}

/// Cells of the lumen on a grid, and ways between them that keep to the middle.
class LumenGrid {
 public:
  static constexpr double kCell_mm = 2;

  explicit LumenGrid(const WallField& wall) : box_(wall.box_world_mm()) {
    size_ = (box_.sizes().array() / kCell_mm).cast<int>() + 1;
    depth_mm_.resize(static_cast<std::size_t>(size_.prod()));
    for (std::size_t cell = 0; cell < depth_mm_.size(); ++cell) {
      depth_mm_[cell] = wall.distance_mm(centre(cell));
      deepest_ = depth_mm_[cell] > depth_mm_[deepest_] ? cell : deepest_;
    }
  }

  [[nodiscard]] std::size_t deepest() const { return deepest_; }
  [[nodiscard]] double depth_mm(std::size_t cell) const { return depth_mm_[cell]; }
  [[nodiscard]] Eigen::Vector3d centre(std::size_t cell) const {
    const auto c = static_cast<int>(cell);
    const Eigen::Array3i index(c % size_.x(), c / size_.x() % size_.y(), c / size_.x() / size_.y());
    return box_.min().array() + kCell_mm * index.cast<double>();
  }

  /// The way from `start` to the cell that is furthest along the lumen, start first (Dijkstra, 1959, with a
  /// price for being near the wall).
  [[nodiscard]] std::vector<std::size_t> max_way(std::size_t start) const {
    constexpr auto kNone = std::numeric_limits<std::size_t>::max();
    std::vector<double> cost(depth_mm_.size(), std::numeric_limits<double>::infinity());
    std::vector<double> length(depth_mm_.size(), 0);
    std::vector<std::size_t> before(depth_mm_.size(), kNone);
    using Entry = std::pair<double, std::size_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    cost[start] = 0;
    open.emplace(0, start);
    std::size_t furthest = start;
    while (!open.empty()) {
      const auto [reached, cell] = open.top();
      open.pop();
      if (reached > cost[cell]) {
        continue;
      }
      furthest = length[cell] > length[furthest] ? cell : furthest;
      for (int n = 0; n < 27; ++n) {
        const Eigen::Array3i move(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        const auto c = static_cast<int>(cell);
        const Eigen::Array3i index =
            Eigen::Array3i(c % size_.x(), c / size_.x() % size_.y(), c / size_.x() / size_.y()) + move;
        if ((index < 0).any() || (index >= size_).any()) {
          continue;
        }
        const auto next =
            static_cast<std::size_t>((index.z() * size_.y() + index.y()) * size_.x() + index.x());
        if (depth_mm_[next] < kMinDepth_mm) {
          continue;
        }
        const double step = kCell_mm * std::sqrt(static_cast<double>(move.square().sum()));
        const double price = step * (1 + std::pow(kWide_mm / depth_mm_[next], 2));
        if (cost[cell] + price < cost[next]) {
          cost[next] = cost[cell] + price;
          length[next] = length[cell] + step;
          before[next] = cell;
          open.emplace(cost[next], next);
        }
      }
    }
    std::vector<std::size_t> way;
    for (std::size_t cell = furthest; cell != kNone; cell = before[cell]) {
      way.push_back(cell);
    }
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  static constexpr double kMinDepth_mm = 1;
  static constexpr double kWide_mm = 12;

  Eigen::AlignedBox3d box_;
  Eigen::Array3i size_;
  std::vector<double> depth_mm_;
  std::size_t deepest_ = 0;
};

std::vector<VesselStation> route_inside(const WallField& wall, const std::string& name) {
  const LumenGrid grid(wall);
  if (grid.depth_mm(grid.deepest()) < kMinRadius_mm) {
    refuse(name, "is nowhere wider than 3 mm; no catheter fits (is it in cm? Scale it to mm)");
  }
  const std::vector<std::size_t> half = grid.max_way(grid.deepest());
  std::vector<std::size_t> way = grid.max_way(half.back());
  if (grid.centre(way.front()).z() > grid.centre(way.back()).z()) {
    std::reverse(way.begin(), way.end());
  }
  std::vector<VesselStation> route;
  for (const std::size_t cell : way) {
    route.push_back({grid.centre(cell), grid.depth_mm(cell)});
  }
  for (int round = 0; round < 40; ++round) {  // the steps of the grid smoothed away
    for (std::size_t i = 1; i + 1 < route.size(); ++i) {
      route[i].p_world_mm = (route[i - 1].p_world_mm + 2 * route[i].p_world_mm + route[i + 1].p_world_mm) / 4;
    }
  }
  return route;
}

}  // namespace

Vessel read_vessel(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  if (ending == ".csv") {
    std::vector<VesselStation> route = read_centreline(file);
    check_route(route, file.string());
    return vessel_along(std::move(route));
  }
  if (ending == ".stl") {
    SurfaceMesh mesh = read_stl(file);
    check_lumen(mesh, file.string());
    WallField wall = wall_of(mesh);
    std::vector<VesselStation> route = route_inside(wall, file.string());
    check_route(route, file.string());
    const Introducer introducer = introducer_of(route);
    return {std::move(wall), introducer, std::move(route)};
  }
  refuse(file.string(), "is neither .csv (centreline with radii) nor .stl (closed surface)");
}

}  // namespace tubed
