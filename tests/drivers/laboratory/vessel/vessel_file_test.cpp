#include "drivers/laboratory/vessel/vessel_file.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "drivers/laboratory/instrument/catheterisation.hpp"
#include "drivers/laboratory/vessel/surface_mesh.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

using std::numbers::pi;
using Corners = std::array<Eigen::Vector3d, 3>;

constexpr int kSides = 32;
constexpr double kRadius_mm = 8;
constexpr double kLength_mm = 120;

/// A closed straight tube along z, outside counter-clockwise.
std::vector<Corners> closed_tube() {
  std::vector<Corners> triangles;
  const auto rim = [](int side, double z) {
    const double angle = 2 * pi * (side % kSides) / kSides;
    return Eigen::Vector3d(kRadius_mm * std::cos(angle), kRadius_mm * std::sin(angle), z);
  };
  for (int side = 0; side < kSides; ++side) {
    for (double z = 0; z < kLength_mm; z += 10) {
      triangles.push_back({rim(side, z), rim(side + 1, z), rim(side + 1, z + 10)});
      triangles.push_back({rim(side, z), rim(side + 1, z + 10), rim(side, z + 10)});
    }
    triangles.push_back({Eigen::Vector3d(0, 0, 0), rim(side + 1, 0), rim(side, 0)});
    triangles.push_back(
        {Eigen::Vector3d(0, 0, kLength_mm), rim(side, kLength_mm), rim(side + 1, kLength_mm)});
  }
  return triangles;
}

class VesselFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  std::filesystem::path write_ascii(const std::vector<Corners>& triangles, double scale = 1) const {
    std::ostringstream text;
    text << "solid vessel\n";
    for (const Corners& corners : triangles) {
      text << "facet normal 0 0 0\nouter loop\n";
      for (const Eigen::Vector3d& corner : corners) {
        text << "vertex " << (scale * corner).transpose() << "\n";
      }
      text << "endloop\nendfacet\n";
    }
    return write("vessel.stl", text.str() + "endsolid vessel\n");
  }

  std::filesystem::path write_binary(const std::vector<Corners>& triangles) const {
    std::string bytes(84, '\0');
    const auto count = static_cast<std::uint32_t>(triangles.size());
    std::memcpy(bytes.data() + 80, &count, 4);
    for (const Corners& corners : triangles) {
      std::array<float, 12> numbers{};
      for (std::size_t i = 0; i < 9; ++i) {
        numbers[3 + i] = static_cast<float>(corners[i / 3][static_cast<Eigen::Index>(i % 3)]);
      }
      bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers)).append(2, '\0');
    }
    return write("vessel.STL", bytes);
  }

  static std::string refusal(const std::filesystem::path& file) {
    try {
      read_vessel(file);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "was taken";
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(VesselFile, AsciiAndBinarySurfacesAreTheSameTube) {
  for (const auto& file : {write_ascii(closed_tube()), write_binary(closed_tube())}) {
    const Vessel vessel = read_vessel(file);
    // A polygon of 32 sides is up to 0.04 mm inside its circle, smoothing takes 0.05 mm.
    EXPECT_NEAR(vessel.wall.distance_mm({5, 0, 60}), 3, 0.12);
    EXPECT_NEAR(vessel.wall.distance_mm({0, 9.5, 40}), -1.5, 0.12);
    EXPECT_NEAR(vessel.route_length_mm(), kLength_mm, 12);
    EXPECT_LT(vessel.introducer.p_world_mm.z(), 6) << "comes in at the lower end";
    EXPECT_GT(vessel.introducer.direction.z(), 0.95);
  }
}

TEST_F(VesselFile, TrianglesThatAllRunTheWrongWayAreTurned) {
  std::vector<Corners> triangles = closed_tube();
  for (Corners& corners : triangles) {
    std::swap(corners[0], corners[1]);
  }
  EXPECT_TRUE(read_vessel(write_ascii(triangles)).wall.contains({0, 0, 60}));
}

TEST_F(VesselFile, AnOpenSurfaceIsRefusedWithThePlace) {
  std::vector<Corners> triangles = closed_tube();
  triangles.erase(triangles.begin() + 7);
  const std::string said = refusal(write_ascii(triangles));
  EXPECT_NE(said.find("not watertight: 3 edges belong to one triangle only"), std::string::npos) << said;
}

TEST_F(VesselFile, OneTriangleTurnedOverIsRefused) {
  std::vector<Corners> triangles = closed_tube();
  std::swap(triangles[5][0], triangles[5][1]);
  const std::string said = refusal(write_ascii(triangles));
  EXPECT_NE(said.find("3 to triangles that do not fit together"), std::string::npos) << said;
}

TEST_F(VesselFile, TwoLumensAreRefused) {
  std::vector<Corners> triangles = closed_tube();
  for (Corners corners : closed_tube()) {
    for (Eigen::Vector3d& corner : corners) {
      corner.x() += 40;
    }
    triangles.push_back(corners);
  }
  const std::string said = refusal(write_ascii(triangles));
  EXPECT_NE(said.find("2 separate surfaces"), std::string::npos) << said;
}

TEST_F(VesselFile, MetresAreRefusedWithWhatToDo) {
  const std::string surface = refusal(write_ascii(closed_tube(), 0.001));
  EXPECT_NE(surface.find("is 0.12 long; a vessel in mm is 30 to 2000; is it in m or cm? Scale it to mm"),
            std::string::npos)
      << surface;
  const std::string line = refusal(write("m.csv", "x,y,z,radius\n0,0,0,0.01\n0,0,0.1,0.01\n"));
  EXPECT_NE(line.find("m.csv:2: radius 0.01"), std::string::npos) << line;
}

TEST_F(VesselFile, BrokenFilesAreRefusedWithLineAndReason) {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"solid x\nfacet normal 0 0 0\nouter loop\nvertex 1 2\n", "bad.stl:4: a vertex needs three numbers"},
      {"solid x\nfacet\nvertex 0 0 0\nendfacet\n", "bad.stl:4: a facet needs three vertices"},
      {"rubbish", "is no STL"},
      {std::string(84, '\0') + "cut", "is no STL"},
      {"solid x\nendsolid facet\n", "has 0 triangles"}};
  for (const auto& [bytes, expected] : bad) {
    EXPECT_NE(refusal(write("bad.stl", bytes)).find(expected), std::string::npos) << expected;
  }
  EXPECT_NE(refusal(folder_ / "nowhere.stl").find("does it exist"), std::string::npos);
  EXPECT_NE(refusal(write("a.obj", "")).find("neither .csv"), std::string::npos);
}

TEST_F(VesselFile, BadCentrelinesAreRefusedWithLineAndReason) {
  const std::string head = "x,y,z,radius\n0,0,0,5\n";
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"x,y,z\n0,0,0\n", ":1: has no column 'radius'"},
      {head + "0,0,one,5\n", ":3: column 3 is no number"},
      {head + "0,0,5\n", ":3: column 4 is no number"},
      {head + "0,0,nan,5\n", ":3: column 3 is no number"},
      {head + "0,0,50,5\n", ":3: is 50"},
      {head + "0,0,5,-1\n", ":3: radius -1"},
      {head + "0,0,9,5\n0,0,1,5\n0,0,10,5\n0,0,19,5\n0,0,28,5\n", "turns by more than 60 deg"},
      {head + "0,0,9,5\n", "30 to 3000"},
      {"", "is empty"}};
  for (const auto& [text, expected] : bad) {
    const std::string said = refusal(write("line.csv", text));
    EXPECT_NE(said.find(expected), std::string::npos) << said;
  }
}

TEST_F(VesselFile, ASurfaceThatFillsARoomIsRefusedBeforeItFillsTheMemory) {
  const Eigen::Vector3d o(0, 0, 0);
  const Eigen::Vector3d x(1500, 0, 0);
  const Eigen::Vector3d y(0, 1500, 0);
  const Eigen::Vector3d z(0, 0, 1500);
  const std::string said = refusal(write_ascii({{o, y, x}, {o, x, z}, {o, z, y}, {x, y, z}}));
  EXPECT_NE(said.find("more than 500 l"), std::string::npos) << said;
}

TEST_F(VesselFile, ACatheterGoesThroughACentrelineOfOnesOwn) {
  std::ostringstream text;
  text << "radius,x,y,z\n";
  for (double u = 0; u < 100; u += 4) {
    text << "6,0,0," << u << "\n";
  }
  for (double angle = 0; angle < pi; angle += 0.1) {
    text << "6," << 35 * (1 - std::cos(angle)) << ",0," << 100 + 35 * std::sin(angle) << "\n";
  }
  const Vessel vessel = read_vessel(write("arch.csv", text.str()));

  const Catheterisation run =
      catheterise(vessel, {}, {80, 0}, std::vector<CatheterCommand>(90, CatheterCommand{1, 0, 0}));

  EXPECT_EQ(run.report().unfinished, 0);
  EXPECT_LT(run.report().max_penetration_mm, 0.3);
  EXPECT_GT(run.shapes.back().at(0).p_world_mm.x(), 25) << "around the bend";
}

}  // namespace
}  // namespace tubed
