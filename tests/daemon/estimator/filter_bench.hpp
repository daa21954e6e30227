// A recursive estimator that is fed from a still arc, for its tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "daemon/estimator/recursive_estimator.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {

/// A filter fed with a measurement every 25 ms, if nothing else is wanted, and an image with every fourth.
struct FilterBench {
  explicit FilterBench(RoomDescription in = one_view_room()) : room(std::move(in)) {
    settings.mode = EstimatorMode::kFilter;
    estimator = make_estimator(settings, room.instruments.front(), room);
  }
  /// One more measurement, displaced by `shift_mm` in z; the shape after it.
  const TubeEstimate& measure(double shift_mm = 0, int outlier = -1) {
    now += interval;
    ++seed;
    EmFrame frame = measure_coils(room, now, 4, frozen ? 1 : seed);
    frame.tracker_frame = seed;
    for (int i = 0; i < frame.coil_count; ++i) {
      frame.coils[static_cast<std::size_t>(i)].p_em_mm.z() +=
          shift_mm + (i == outlier || i == second_outlier ? outlier_mm : 0);
      if (i == missing) {
        frame.coils[static_cast<std::size_t>(i)] = CoilSample{};
      }
    }
    history->add(frame);
    return estimate_now(with_images && seed % 4 == 0);
  }
  void measure_times(int count) {
    for (int i = 0; i < count; ++i) {
      measure();
    }
  }
  /// The same, with all coils off by so much in z.
  void measure_shifted_times(double shift_mm, int count) {
    for (int i = 0; i < count; ++i) measure(shift_mm);
  }
  /// Something hides a stretch of the tube in the first view and leads the shape up to 11 mm beside it,
  /// further than lines reach; then the tube is seen again.
  void catch_and_show_again() {
    hidden = kDecoy;
    for (int i = 0; i < 200; ++i) {
      decoy_mm = std::min(11.0, 0.08 * i);
      measure();
    }
    ASSERT_GT(beside_mm(), 9);
    hidden = {};
  }
  /// One coil off by 20 mm in the one measurement after 43 good ones; the error before it.
  double measure_with_one_coil_off() {
    measure_times(43);
    const double before_mm = rms_mm();
    outlier_mm = 20;
    measure(0, 1);
    return before_mm;
  }
  /// An image that much later, without a measurement since; the shape after it.
  const TubeEstimate& show_image(std::chrono::milliseconds later) {
    now += later;
    return estimate_now(true);
  }
  const TubeEstimate& estimate_now(bool is_image) {
    Observation observation;
    observation.instant = observation.now = now;
    observation.em = history.get();
    observation.is_image_instant = is_image;
    if (is_image) {
      RoomDescription displaced = room;
      displaced.cameras[0].T_camera_world.translation().x() += image_off_mm;
      image = image_of_arc(displaced, now, straight_tip_mm > 0 ? Stretch{-1, straight_tip_mm} : hidden);
      for (float& vesselness : image.vesselness) vesselness *= tube_contrast;
      for (double s = 0; s < straight_tip_mm; s += 0.25) {
        draw_ridge(Camera(displaced.cameras[0]), straight_tip(s), 0.9, image);
      }
      for (double s = kDecoy.from_mm; s < kDecoy.to_mm && decoy_mm > 0; s += 0.25) {
        if (std::fmod(s, 12) < 2) {  // broken, as what is not a tube often is
          draw_ridge(Camera(displaced.cameras[0]), decoy_point(s), 0.9, image);
        }
      }
      for (double s = kDecoy.from_mm; s < kDecoy.to_mm && other_tube_mm > 0; s += 0.25) {
        draw_ridge(Camera(displaced.cameras[0]), arc_point(s) + other_tube_mm * aside(s), 1.8, image);
      }
      image.geometry = own_geometry;
      image.brought_geometry = own_geometry.has_value();
      newest_image = now;
      observation.images[0] = &image;
      for (std::size_t view = 1; view < room.cameras.size() && with_further_views; ++view) {
        further_images[view] = image_of_arc(room, now, {}, view);
        observation.images[view] = &further_images[view];
      }
    }
    observation.newest_image = newest_image;
    observation.image_timeout = std::chrono::milliseconds(120);
    estimator->estimate(observation, *estimate);
    return *estimate;
  }
  /// RMS over s = 0 .. 370, the truth being displaced by `shift_mm` in z.
  [[nodiscard]] double rms_mm(double shift_mm = 0) const {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < estimate->point_count; ++i) {
      const double s =
          static_cast<double>(estimate->length_mm) * static_cast<double>(i) / (estimate->point_count - 1);
      if (s <= 370) {
        const Eigen::Vector3d truth = arc_point(s) + Eigen::Vector3d(0, 0, shift_mm);
        sum +=
            (Eigen::Map<const Eigen::Vector3d>(estimate->points[i].p_world_mm.data()) - truth).squaredNorm();
        ++count;
      }
    }
    return count > 0 ? std::sqrt(sum / count) : 1e9;
  }
  /// Where the last `straight_tip_mm` are if they go straight on.
  [[nodiscard]] Eigen::Vector3d straight_tip(double s_mm) const {
    return arc_point(straight_tip_mm) + (straight_tip_mm - s_mm) * arc_tangent_to_tip(straight_tip_mm);
  }
  /// A stretch of something else, up to `decoy_mm` beside the arc in the image.
  [[nodiscard]] Eigen::Vector3d decoy_point(double s_mm) const {
    const double part = (s_mm - kDecoy.from_mm) / (kDecoy.to_mm - kDecoy.from_mm);
    return arc_point(s_mm) + decoy_mm * std::min(1.0, 2 * std::pow(std::sin(M_PI * part), 2)) * aside(s_mm);
  }
  /// Across the arc in the image, unit.
  [[nodiscard]] static Eigen::Vector3d aside(double s_mm) {
    return arc_tangent_to_tip(s_mm).cross(Eigen::Vector3d::UnitZ()).normalized();
  }
  /// How far the shape is from the arc in the image, in the middle of that stretch, as mm of the world.
  [[nodiscard]] double beside_mm() const {
    const double s_mm = (kDecoy.from_mm + kDecoy.to_mm) / 2;
    const auto i = static_cast<std::size_t>(
        std::lround(s_mm / static_cast<double>(estimate->length_mm) * (estimate->point_count - 1)));
    const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3d>(estimate->points[i].p_world_mm.data());
    return std::abs(aside(s_mm).dot(p - arc_point(s_mm)));
  }
  static constexpr Stretch kDecoy{20, 165};
  RoomDescription room;
  EstimatorSettings settings;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  ImageMeasurement image;  ///< of the first view
  std::array<ImageMeasurement, kMaxCameras> further_images{};
  MonotonicTime newest_image{};
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
  std::chrono::milliseconds interval{25};
  bool with_images = true;
  bool with_further_views = true;
  double outlier_mm = 30;
  int second_outlier = -1;     ///< coil that is wrong beside the one of measure()
  int missing = -1;            ///< coil that drops out
  bool frozen = false;         ///< coils err by the same at each measurement
  Stretch hidden;              ///< of the arc, in the image
  double decoy_mm = 0;         ///< 0: none
  float tube_contrast = 1;     ///< of the tube against what else there is
  double other_tube_mm = 0;    ///< so far beside that stretch lies another, clearer one; 0: none
  double straight_tip_mm = 0;  ///< so much of the arc is shown going straight on
  std::optional<ViewGeometry> own_geometry{};  ///< that comes with images of the first view
  double image_off_mm = 0;                     ///< what the image shows is so far beside the coils
};

}  // namespace tubed
