#include "drivers/laboratory/vessel/surface_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>

namespace tubed {

namespace {

constexpr double kMinExtent_mm = 30;
constexpr double kMaxExtent_mm = 2000;
constexpr double kMaxVolume_mm3 = 5e8;  ///< of the box around it: 150 million cells of the grid of distances

using Triangle = std::array<std::uint32_t, 3>;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw std::invalid_argument(where + ": " + what);
}

/// Gives equal corners one number.
class CornerIndex {
 public:
  explicit CornerIndex(SurfaceMesh& mesh) : mesh_(mesh) {}
  std::uint32_t of(const Eigen::Vector3d& corner) {
    const auto [place, is_new] = numbers_.try_emplace({corner.x(), corner.y(), corner.z()},
                                                      static_cast<std::uint32_t>(mesh_.corners_mm.size()));
    if (is_new) {
      mesh_.corners_mm.push_back(corner);
    }
    return place->second;
  }

 private:
  SurfaceMesh& mesh_;
  std::map<std::array<double, 3>, std::uint32_t> numbers_;
};

bool add_triangle(SurfaceMesh& mesh, CornerIndex& index, const std::array<Eigen::Vector3d, 3>& corners) {
  if (!corners[0].allFinite() || !corners[1].allFinite() || !corners[2].allFinite()) {
    return false;
  }
  const Triangle triangle{index.of(corners[0]), index.of(corners[1]), index.of(corners[2])};
  if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0]) {
    mesh.triangles.push_back(triangle);  // what shrank to a line closes nothing and opens nothing
  }
  return true;
}

constexpr std::size_t kBinaryHeader = 84;
constexpr std::size_t kBinaryTriangle = 50;

SurfaceMesh read_binary(const std::string& bytes, const std::string& name) {
  SurfaceMesh mesh;
  CornerIndex index(mesh);
  const std::size_t count = (bytes.size() - kBinaryHeader) / kBinaryTriangle;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 12> numbers{};  // normal and three corners
    std::memcpy(numbers.data(), bytes.data() + kBinaryHeader + i * kBinaryTriangle, sizeof(numbers));
    std::array<Eigen::Vector3d, 3> corners;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      corners[corner] = Eigen::Map<const Eigen::Vector3f>(&numbers[3 + 3 * corner]).cast<double>();
    }
    if (!add_triangle(mesh, index, corners)) {
      refuse(name, "triangle " + std::to_string(i + 1) + " has a corner that is no number; export it again");
    }
  }
  return mesh;
}

SurfaceMesh read_ascii(const std::string& text, const std::string& name) {
  SurfaceMesh mesh;
  CornerIndex index(mesh);
  std::istringstream lines(text);
  std::array<Eigen::Vector3d, 3> corners;
  std::size_t known = 0;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string where = name + ":" + std::to_string(number);
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "vertex") {
      if (known == 3) {
        refuse(where, "a fourth vertex in one facet; only triangles can be read");
      }
      Eigen::Vector3d& corner = corners[known++];
      if (!(words >> corner.x() >> corner.y() >> corner.z())) {
        refuse(where, "a vertex needs three numbers");
      }
    } else if (word == "endfacet") {
      if (known != 3 || !add_triangle(mesh, index, corners)) {
        refuse(where, "a facet needs three vertices");
      }
      known = 0;
    }
  }
  return mesh;
}

bool is_binary(const std::string& bytes) {
  if (bytes.size() < kBinaryHeader) {
    return false;
  }
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof(count));
  return bytes.size() == kBinaryHeader + static_cast<std::size_t>(count) * kBinaryTriangle;
}

/// How often an edge is run along in its own direction (from the smaller number) and against it.
struct EdgeUse {
  int forward = 0;
  int backward = 0;
};

std::map<std::pair<std::uint32_t, std::uint32_t>, EdgeUse> edges_of(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, EdgeUse> edges;
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i];
      const std::uint32_t b = triangle[(i + 1) % 3];
      EdgeUse& use = edges[std::minmax(a, b)];
      ++(a < b ? use.forward : use.backward);
    }
  }
  return edges;
}

std::size_t pieces_of(const SurfaceMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.corners_mm.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t corner) {
    while (parent[corner] != corner) {
      corner = parent[corner] = parent[parent[corner]];
    }
    return corner;
  };
  std::vector<bool> used(mesh.corners_mm.size(), false);
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      used[corner] = true;
      parent[root(corner)] = root(triangle[0]);
    }
  }
  std::size_t pieces = 0;
  for (std::uint32_t corner = 0; corner < parent.size(); ++corner) {
    pieces += used[corner] && root(corner) == corner ? 1 : 0;
  }
  return pieces;
}

double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const auto beyond = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return normal.cross(to - from).dot(p - from) < 0;
  };
  const auto to_edge = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const Eigen::Vector3d edge = to - from;
    const double share = std::clamp((p - from).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    return (p - from - share * edge).norm();
  };
  if (normal.squaredNorm() > 0 && !beyond(a, b) && !beyond(b, c) && !beyond(c, a)) {
    return std::abs(normal.normalized().dot(p - a));
  }
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

/// Crossings of the line through (y, z) along x with the triangle, if it is crossed.
void add_crossing(const std::array<Eigen::Vector3d, 3>& corners, double y, double z,
                  std::vector<double>& at_x) {
  const auto side = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return (to.y() - from.y()) * (z - from.z()) - (to.z() - from.z()) * (y - from.y());
  };
  const double ab = side(corners[0], corners[1]);
  const double bc = side(corners[1], corners[2]);
  const double ca = side(corners[2], corners[0]);
  const double sum = ab + bc + ca;
  if ((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0)) {
    at_x.push_back((bc * corners[0].x() + ca * corners[1].x() + ab * corners[2].x()) / sum);
  }
}

}  // namespace

double SurfaceMesh::volume_mm3() const {
  double volume = 0;
  for (const Triangle& triangle : triangles) {
    volume += corners_mm[triangle[0]].dot(corners_mm[triangle[1]].cross(corners_mm[triangle[2]])) / 6;
  }
  return volume;
}

SurfaceMesh read_stl(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) {
    refuse(file.string(), "cannot be read; does it exist?");
  }
  const std::string name = file.string();
  if (is_binary(bytes)) {
    return read_binary(bytes, name);
  }
  if (bytes.find("facet") == std::string::npos) {
    refuse(name,
           "is no STL: neither text with 'facet' nor as long as its binary header says; is it cut short?");
  }
  return read_ascii(bytes, name);
}

void check_lumen(SurfaceMesh& mesh, const std::string& name) {
  if (mesh.triangles.size() < 4) {
    refuse(name,
           "has " + std::to_string(mesh.triangles.size()) + " triangles; a closed surface has 4 at least");
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& corner : mesh.corners_mm) {
    box.extend(corner);
  }
  const double extent = box.sizes().maxCoeff();
  if (extent < kMinExtent_mm || extent > kMaxExtent_mm) {
    std::ostringstream text;
    text << "is " << extent << " long; a vessel in mm is 30 to 2000"
         << (extent < kMinExtent_mm ? "; is it in m or cm? Scale it to mm" : "; is it in um? Scale it to mm");
    refuse(name, text.str());
  }
  if (box.volume() > kMaxVolume_mm3) {
    std::ostringstream text;
    text << "fills a box of " << box.sizes().transpose() << " mm, more than " << kMaxVolume_mm3 * 1e-6
         << " l; cut out the part of the vessel that the catheter is in";
    refuse(name, text.str());
  }
  std::size_t open = 0;
  std::size_t torn = 0;
  Eigen::Vector3d example = Eigen::Vector3d::Zero();
  for (const auto& [edge, use] : edges_of(mesh)) {
    if (use.forward != 1 || use.backward != 1) {
      ++(use.forward + use.backward == 1 ? open : torn);
      example = mesh.corners_mm[edge.first];
    }
  }
  if (open + torn > 0) {
    std::ostringstream text;
    text << "is not watertight: " << open << " edges belong to one triangle only, " << torn
         << " to triangles that do not fit together, e.g. at (" << example.transpose()
         << "); close its holes and export it again";
    refuse(name, text.str());
  }
  const std::size_t pieces = pieces_of(mesh);
  if (pieces != 1) {
    refuse(name,
           "consists of " + std::to_string(pieces) + " separate surfaces; keep the one lumen that is meant");
  }
  if (mesh.volume_mm3() < 0) {
    for (Triangle& triangle : mesh.triangles) {
      std::swap(triangle[1], triangle[2]);
    }
  }
}

WallField wall_of(const SurfaceMesh& mesh, double spacing_mm) {
  constexpr double kBand_mm = WallField::kReach_mm;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& corner : mesh.corners_mm) {
    box.extend(corner);
  }
  // A little off the round numbers that corners like to have: no line runs along an edge.
  const Eigen::Vector3d origin = box.min().array() - (kBand_mm + 2 * spacing_mm) +
                                 spacing_mm * Eigen::Array3d(0.00131, 0.00217, 0.00173);
  const Eigen::Array3i size =
      ((box.sizes().array() + 2 * kBand_mm + 4 * spacing_mm) / spacing_mm).ceil().cast<int>() + 1;
  const auto first_at = [&](double value, int axis) {
    return std::max(0, static_cast<int>(std::ceil((value - origin[axis]) / spacing_mm)));
  };
  const auto last_at = [&](double value, int axis) {
    return std::min(size[axis] - 1, static_cast<int>(std::floor((value - origin[axis]) / spacing_mm)));
  };
  std::vector<float> distances(static_cast<std::size_t>(size.cast<Eigen::Index>().prod()),
                               static_cast<float>(kBand_mm));
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(size.y() * size.z()));
  for (const Triangle& triangle : mesh.triangles) {
    const std::array<Eigen::Vector3d, 3> corners{mesh.corners_mm[triangle[0]], mesh.corners_mm[triangle[1]],
                                                 mesh.corners_mm[triangle[2]]};
    const Eigen::Vector3d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]).array() - kBand_mm;
    const Eigen::Vector3d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]).array() + kBand_mm;
    for (int k = first_at(low.z(), 2); k <= last_at(high.z(), 2); ++k) {
      for (int j = first_at(low.y(), 1); j <= last_at(high.y(), 1); ++j) {
        const double y = origin.y() + j * spacing_mm;
        const double z = origin.z() + k * spacing_mm;
        add_crossing(corners, y, z, crossings[static_cast<std::size_t>(k * size.y() + j)]);
        float* row = &distances[static_cast<std::size_t>((k * size.y() + j) * size.x())];
        for (int i = first_at(low.x(), 0); i <= last_at(high.x(), 0); ++i) {
          const Eigen::Vector3d p(origin.x() + i * spacing_mm, y, z);
          const double distance = distance_to_triangle(p, corners[0], corners[1], corners[2]);
          row[i] = std::min(row[i], static_cast<float>(distance));
        }
      }
    }
  }
  for (std::size_t line = 0; line < crossings.size(); ++line) {
    std::sort(crossings[line].begin(), crossings[line].end());
    std::size_t passed = 0;
    for (int i = 0; i < size.x(); ++i) {
      while (passed < crossings[line].size() && crossings[line][passed] < origin.x() + i * spacing_mm) {
        ++passed;
      }
      float& distance = distances[line * static_cast<std::size_t>(size.x()) + static_cast<std::size_t>(i)];
      distance = passed % 2 == 1 ? distance : -distance;
    }
  }
  return {origin, spacing_mm, size, std::move(distances)};
}

}  // namespace tubed
