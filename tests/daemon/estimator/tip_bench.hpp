// A TipShape that is asked about the images of a still tube.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/estimator/tip/tip_shape.hpp"
#include "tests/daemon/estimator/hooked_tube.hpp"

namespace tubed {

/// Images and coils of one instant after another.
struct TipBench {
  explicit TipBench(HookedTube tube_, double first_coil_mm = 8, RestShape told = RestShape::kUnknown)
      : tube(tube_), room(room_with_first_coil(first_coil_mm)) {
    InstrumentDescription& instrument = room.instruments.front();
    instrument.rest_shape = told;
    instrument.hook_radius_mm = 8;
    instrument.hook_length_mm = 14;
    shape = std::make_unique<TipShape>(EstimatorSettings{}, instrument, room);
  }

  /// The next image, `later_s` after the one before it.
  bool ask(double later_s = 0.6) {
    now += std::chrono::nanoseconds(static_cast<std::int64_t>(later_s * 1e9));
    const EmFrame frame = measure_hooked(tube, room, now, 0.5, 0.005, ++seed);
    history->add(frame);
    coils = observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
    image = tube.length_mm == 0 ? image_of_arc(room, now) : image_of_hooked(tube, room, now);
    Observation observation;
    observation.instant = observation.now = observation.newest_image = now;
    observation.is_image_instant = true;
    observation.em = history.get();
    observation.images[0] = &image;
    return shape->ask(observation, coils);
  }
  HookedTube tube;
  RoomDescription room;
  std::unique_ptr<TipShape> shape;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  CoilObservations coils;
  ImageMeasurement image;
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
};

inline constexpr HookedTube kStraightTube{8, 0, 0};

}  // namespace tubed
