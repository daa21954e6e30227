// Pictures of the arc that come as negatives or mirrored.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "daemon/estimator/images/misread_images.hpp"
#include "daemon/image/vesselness_meter.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {

inline constexpr std::chrono::milliseconds kBetweenImages{133};

/// How the pictures of the arc come.
enum class Picture { kAsItIs, kNegative, kMirrored, kWithoutTube };

/// Dark tubes on a bright ground, a coil measurement with each image.
class MisreadBench {
 public:
  /// The first camera of `room` takes the pictures.
  explicit MisreadBench(Picture picture, PolaritySetting polarity = PolaritySetting::kDark,
                        RoomDescription room = one_view_room())
      : polarity_(polarity),
        room_(well_registered(std::move(room))),
        history_(std::make_unique<EmHistory>()),
        image_(image_of_arc(room_, from_ns(1))),
        on_demand_(image_.width, image_.height, FrangiSettings{}),
        misread_(EstimatorSettings{}, room_.instruments.front(), room_) {
    for (std::size_t i = 0; i < image_.grey.size(); ++i) {
      const float grain = static_cast<float>((i * 7 + i / 400 * 13) % 5);
      const float tube = picture == Picture::kWithoutTube ? 0 : image_.vesselness[i];
      const float grey = 180 + grain - 60 * tube;
      image_.grey[i] = picture == Picture::kNegative ? 255 - grey : grey;
    }
    for (int y = 0; picture == Picture::kMirrored && y < image_.height; ++y) {
      const auto row = image_.grey.begin() + y * image_.width;
      std::reverse(row, row + image_.width);
    }
    const auto [darkest, brightest] = std::minmax_element(image_.grey.begin(), image_.grey.end());
    image_.darkest = *darkest;
    image_.brightest = *brightest;
    measure(std::nullopt);
  }

  /// From the next image on it is read for tubes of that polarity, where it is left open.
  void measure(std::optional<RidgePolarity> found) {
    FrangiSettings settings;
    settings.polarity = polarity_;
    VesselnessMeter meter(image_.width, image_.height, settings);
    if (found) meter.read_as(*found);
    ImageArea whole = image_.measured;
    whole.add_whole();
    meter.take(image_, whole);
  }

  /// The next image comes; the observation of its instant.
  const Observation& next() {
    now_ += kBetweenImages;
    history_->add(measure_coils(room_, now_, 0.5, ++seed_));
    image_.exposure = now_;
    observation_ = {};
    observation_.instant = observation_.now = observation_.newest_image = now_;
    observation_.is_image_instant = true;
    observation_.em = history_.get();
    observation_.images[0] = &image_;
    observation_.on_demand[0] = &on_demand_;
    if (of_second_camera && seed_ % 7 == 0) {
      of_second_camera->camera = 1;
      of_second_camera->exposure = now_;
      observation_.images[1] = &*of_second_camera;
      observation_.on_demand[1] = &on_demand_;
    }
    observation_.image_timeout = std::chrono::seconds(1);
    return observation_;
  }

  void look_at(const Observation& observation) { misread_.look(observation, true); }

  MisreadImages& look(double seconds, bool lost = true) {
    for (int i = 0; i < static_cast<int>(seconds / 0.133); ++i) misread_.look(next(), lost);
    return misread_;
  }

  std::optional<ImageMeasurement> of_second_camera;  ///< comes with every seventh image of the first one

  [[nodiscard]] const RoomDescription& room() const { return room_; }
  [[nodiscard]] const ImageMeasurement& image() const { return image_; }

 private:
  PolaritySetting polarity_;
  RoomDescription room_;
  std::unique_ptr<EmHistory> history_;
  ImageMeasurement image_;
  ImageOnDemand on_demand_;
  MisreadImages misread_;
  Observation observation_;
  MonotonicTime now_ = from_ns(1'000'000'000);
  unsigned seed_ = 0;
};

}  // namespace tubed
