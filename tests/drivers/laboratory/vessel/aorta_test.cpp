#include "drivers/laboratory/vessel/aorta.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

/// Mean distance of the wall from the route on four sides, twice.
double diameter_mm(const Vessel& aorta, double u_mm) {
  const Eigen::Vector3d centre_mm = aorta.route_point(u_mm);
  const Eigen::Vector3d along = (aorta.route_point(u_mm + 1) - centre_mm).normalized();
  const Eigen::Vector3d side = along.unitOrthogonal();
  double sum_mm = 0;
  for (const Eigen::Vector3d& direction : {side, Eigen::Vector3d(-side), Eigen::Vector3d(along.cross(side)),
                                           Eigen::Vector3d(-along.cross(side))}) {
    double radius_mm = 0;
    while (aorta.wall.contains(centre_mm + radius_mm * direction)) {
      radius_mm += 0.01;
    }
    sum_mm += radius_mm;
  }
  return sum_mm / 2;
}

TEST(Aorta, TheMeanPatientHasTheTablesDiameters) {
  const AortaDimensions size = aorta_of_patient(0);
  const Vessel aorta = make_aorta(size);
  // The way ends at the valve; access and abdominal aorta are 100 + 2 * 50 + 150 mm long.
  const double ascending_mm = aorta.route_length_mm() - 20 - 0.6 * size.ascending_length;
  const double diaphragm_mm = 350;
  EXPECT_NEAR(diameter_mm(aorta, diaphragm_mm), 24.3, 0.3);                           // Hager 2002
  EXPECT_NEAR(diameter_mm(aorta, diaphragm_mm + size.descending_length), 24.7, 0.3);  // isthmus
  EXPECT_NEAR(diameter_mm(aorta, ascending_mm), 30.9, 0.3);
  EXPECT_NEAR(diameter_mm(aorta, 60), 8.0, 0.3);
}

TEST(Aorta, TheArchTurnsFromUpToDownAndItsCentreIsTheOrigin) {
  const Vessel aorta = make_aorta({});
  double highest_mm = -1e9;
  for (const VesselStation& station : aorta.route) {
    highest_mm = std::max(highest_mm, station.p_world_mm.z());
  }
  EXPECT_NEAR(highest_mm, 30, 8);
  EXPECT_LT(aorta.route.back().p_world_mm.z(), -50);
  EXPECT_LT(aorta.route.front().p_world_mm.z(), -400);
  EXPECT_LT(aorta.route.back().p_world_mm.y(), 0) << "the valve is anterior";
}

TEST(Aorta, ItIsClosedAtTheValveAndOpenToThreeBranches) {
  const Vessel aorta = make_aorta({});
  const auto n = aorta.route.size();
  const Eigen::Vector3d valve_mm = aorta.route[n - 1].p_world_mm;
  const Eigen::Vector3d downstream = (valve_mm - aorta.route[n - 10].p_world_mm).normalized();
  EXPECT_TRUE(aorta.wall.contains(valve_mm - 2 * downstream));
  EXPECT_FALSE(aorta.wall.contains(valve_mm + 5 * downstream));
  // A horizontal cut 50 mm above the arch's centre meets the three branches.
  int lumens = 0;
  for (int x = -60; x <= 60; ++x) {
    for (int y = -60; y <= 60; ++y) {
      const auto inside = [&](int dx, int dy) {
        return aorta.wall.distance_mm(Eigen::Vector3d(x + dx, y + dy, 55));
      };
      const double here = inside(0, 0);
      lumens += here > 2 && here >= inside(1, 0) && here > inside(-1, 0) && here >= inside(0, 1) &&
                        here > inside(0, -1)
                    ? 1
                    : 0;
    }
  }
  EXPECT_EQ(lumens, 3);
}

TEST(Aorta, AnotherSeedIsAnotherPatientAndTheSameSeedTheSame) {
  EXPECT_NE(aorta_of_patient(1).ascending_diameter, aorta_of_patient(2).ascending_diameter);
  EXPECT_EQ(aorta_of_patient(1).arch_radius, aorta_of_patient(1).arch_radius);
  for (int seed = 1; seed < 200; ++seed) {
    EXPECT_NEAR(aorta_of_patient(seed).ascending_diameter, 30.9, 1.2 * 4.4);
  }
}

}  // namespace
}  // namespace tubed
