// A patient with a reference before a field generator that moves: exact measurements in its frame.
#pragma once

#include <cmath>
#include <numbers>

#include "daemon/estimator/reference/em_reference.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {

/// The generator's frame, the catheter of one_view_room() and, behind its coils, the reference: sensor 6, and
/// 7 of two coils. At registration the tracker's frame is the world's.
struct MovingGenerator {
  RoomDescription room = one_view_room();
  RigidTransform T_rest_em = RigidTransform::Identity();  ///< where the generator is now
  RigidTransform T_world_reference = RigidTransform(Eigen::Translation3d(70, 40, 60));
  std::mt19937 random{1};
  double noise_mm = 1e-6;  ///< no two measurements are equal to the last bit

  static MovingGenerator with_sensor() {
    MovingGenerator bench;
    bench.room.reference = ReferenceDescription{};
    bench.room.reference->sensors = {6};
    bench.room.reference->T_em_reference_registered = bench.T_world_reference;
    return bench;
  }
  static MovingGenerator with_coils() {
    MovingGenerator bench = with_sensor();
    bench.room.reference->sensors = {6, 7};
    bench.room.reference->p_em_registered_mm = {bench.T_world_reference * Eigen::Vector3d(-15, 0, 0),
                                                bench.T_world_reference * Eigen::Vector3d(15, 0, 0)};
    bench.room.reference->axis_em_registered = {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY()};
    return bench;
  }

  void push(double mm, double deg) {
    const Eigen::AngleAxisd turn(deg * std::numbers::pi / 180, Eigen::Vector3d(1, 2, -1).normalized());
    T_rest_em =
        RigidTransform(Eigen::Translation3d(mm * Eigen::Vector3d(2, -1, 1).normalized()) * turn) * T_rest_em;
  }

  [[nodiscard]] bool has_two_coils() const { return room.reference->has_two_coils(); }

  EmFrame measure(std::int64_t ms) {
    EmFrame frame =
        measure_coils(room, from_ns(1'000'000'000 + ms * 1'000'000), 0, static_cast<unsigned>(ms));
    frame.coil_count = has_two_coils() ? 7 : 6;
    const auto put = [&](std::size_t index, const Eigen::Vector3d& p, const Eigen::Vector3d& z) {
      frame.coils[index].status = CoilStatus::kOk;
      frame.coils[index].p_em_mm = T_world_reference * p;
      frame.coils[index].tangent_em = T_world_reference.linear() * z;
      frame.coils[index].x_axis_em = T_world_reference.linear() * Eigen::Vector3d::UnitX();
    };
    if (has_two_coils()) {
      put(5, {-15, 0, 0}, Eigen::Vector3d::UnitZ());
      put(6, {15, 0, 0}, Eigen::Vector3d::UnitY());
    } else {
      put(5, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
    }
    const RigidTransform T_em_rest = T_rest_em.inverse();
    std::normal_distribution<double> normal(0, noise_mm);
    for (CoilSample& coil : frame.coils) {
      if (coil.status == CoilStatus::kOk) {
        coil.p_em_mm =
            T_em_rest * coil.p_em_mm + Eigen::Vector3d(normal(random), normal(random), normal(random));
        coil.tangent_em = T_em_rest.linear() * coil.tangent_em;
        coil.x_axis_em = T_em_rest.linear() * coil.x_axis_em;
      }
    }
    return frame;
  }
};

}  // namespace tubed
