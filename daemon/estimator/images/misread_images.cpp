#include "daemon/estimator/images/misread_images.hpp"

#include <algorithm>
#include <array>

#include "daemon/image/vesselness_meter.hpp"

namespace tubed {

namespace {

constexpr double kBetween_s = 0.1;  // between two readings
constexpr int kAtOnce = 3;          // readings of one image, where images come seldom
constexpr int kReadOften = 60;      // readings, then kAtOnce a second
constexpr double kBetweenSeldom_s = 1;
constexpr double kMinInView = 0.15;  // share of the tube
constexpr int kRemembered = 8;       // images read in the same way
constexpr int kMinRead = 4;
constexpr std::array kReadAs{Discord::kNone, Discord::kNegative, Discord::kMirrored};
constexpr std::size_t kReadings = kReadAs.size();
// Shares of lines, means: a tube that is seen has 0.7 to 0.9, another way of reading its images 0.15 to 0.5.
constexpr double kAgrees = 0.62;
constexpr double kBetterBy = 0.2;
constexpr double kNoLongerBetterBy = 0.1;

EstimatorSettings joint(EstimatorSettings settings) {
  settings.mode = EstimatorMode::kJoint;
  return settings;
}

// The image as it is, as a negative or mirrored, with no vesselness measured yet.
void draw(const ImageMeasurement& image, Discord as, ImageMeasurement& picture) {
  picture.camera = image.camera;
  picture.state = image.state;
  picture.origin = image.origin;
  picture.exposure = image.exposure;
  picture.geometry = image.geometry;
  picture.brought_geometry = image.brought_geometry;
  picture.darkest = image.darkest;
  picture.brightest = image.brightest;
  picture.polarity = image.polarity;
  picture.structureness = image.structureness;
  picture.measured.clear();
  const std::size_t size = std::min(image.grey.size(), picture.grey.size());
  const auto end = image.grey.begin() + static_cast<std::ptrdiff_t>(size);
  if (as == Discord::kNegative) {
    const float sum = image.darkest + image.brightest;
    std::transform(image.grey.begin(), end, picture.grey.begin(), [sum](float grey) { return sum - grey; });
    return;
  }
  std::copy(image.grey.begin(), end, picture.grey.begin());
  for (int y = 0; as == Discord::kMirrored && y < picture.height; ++y) {
    const auto row = picture.grey.begin() + static_cast<std::ptrdiff_t>(y) * picture.width;
    std::reverse(row, row + picture.width);
  }
}

}  // namespace

MisreadImages::MisreadImages(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                             const RoomDescription& room)
    : estimator_(joint(settings), instrument, room),
      estimate_(std::make_unique<TubeEstimate>()),
      pictures_(room.cameras.size()),
      views_(room.cameras.size()) {
  for (std::size_t camera = 0; camera < room.cameras.size(); ++camera) {
    pictures_[camera].reserve(room.cameras[camera].width, room.cameras[camera].height);
    for (const Discord as : kReadAs) {
      readings_.push_back({.as = as, .camera = camera});
    }
  }
}

void MisreadImages::forget() {
  for (std::size_t camera = 0; camera < views_.size(); ++camera) forget(camera);
}

void MisreadImages::forget(std::size_t camera) {
  for (Reading& reading : readings_) {
    if (reading.camera == camera) reading = {.as = reading.as, .camera = camera};
  }
  views_[camera].read = 0;
  views_[camera].newest = MonotonicTime{};
  if (found_ && found_->camera == camera) found_.reset();
}

void MisreadImages::Reading::add(double share) {
  count = std::min(count + 1, kRemembered);
  agreeing += (share - agreeing) / count;
}

int MisreadImages::due(const View& view, MonotonicTime instant) {
  const double since_s = seconds_between(view.newest, instant);
  if (view.read >= kReadOften && since_s < kBetweenSeldom_s) return 0;
  return static_cast<int>(std::clamp(since_s / kBetween_s, 0.0, 1.0 * kAtOnce));
}

// Of the cameras with an image of this instant: one that brings few is not to wait behind one that brings
// many.
std::optional<std::size_t> MisreadImages::longest_unread(const Observation& observation) const {
  std::optional<std::size_t> longest;
  for (std::size_t camera = 0; camera < views_.size(); ++camera) {
    const ImageMeasurement* const image = observation.images[camera];
    if (image == nullptr || image->state != ImageState::kMeasured ||
        observation.on_demand[camera] == nullptr) {
      continue;
    }
    if (!longest || views_[camera].newest < views_[*longest].newest) longest = camera;
  }
  return longest;
}

std::optional<RidgePolarity> MisreadImages::polarity_of(std::size_t camera) const {
  if (!found_ || found_->reading != Discord::kNegative || found_->camera != camera) return std::nullopt;
  const View& view = views_[camera];
  if (!view.polarity_is_open) return std::nullopt;
  return view.polarity == RidgePolarity::kDark ? RidgePolarity::kBright : RidgePolarity::kDark;
}

// What was read of images with the other polarity says nothing of these.
void MisreadImages::notice_polarity(const Observation& observation) {
  for (std::size_t camera = 0; camera < views_.size(); ++camera) {
    const ImageMeasurement* const image = observation.images[camera];
    if (image == nullptr || image->state != ImageState::kMeasured) continue;
    if (image->polarity != views_[camera].polarity) forget(camera);
    views_[camera].polarity = image->polarity;
    views_[camera].polarity_is_open = image->finds_polarity;
  }
}

void MisreadImages::look(const Observation& observation, bool lost) {
  if (!observation.is_image_instant) return;
  notice_polarity(observation);
  if (!lost && !found_) {
    for (View& view : views_) view.read = 0;
    return;
  }
  const auto camera = longest_unread(observation);
  if (!camera) return;
  View& view = views_[*camera];
  for (int due = this->due(view, observation.instant); due > 0; --due) {
    view.newest = observation.instant;
    ++view.read;
    read(observation, readings_[*camera * kReadings + view.next]);
    view.next = (view.next + 1) % kReadings;
    conclude();
  }
}

void MisreadImages::read(const Observation& observation, Reading& reading) {
  ImageMeasurement& picture = pictures_[reading.camera];
  draw(*observation.images[reading.camera], reading.as, picture);
  observation.on_demand[reading.camera]->filter_all(picture);
  Observation alone = observation;
  alone.images = {};
  alone.images[reading.camera] = &picture;
  alone.on_demand = {};
  estimator_.reset();
  estimator_.update(alone, *estimate_);
  if (static_cast<double>(estimate_->in_view_ratio) < kMinInView) return;
  reading.add(static_cast<double>(estimate_->image_inlier_ratio));
}

// With hysteresis, so that the word does not flicker.
void MisreadImages::conclude() {
  std::optional<Found> best;
  for (std::size_t first = 0; first < readings_.size(); first += kReadings) {
    const Reading& as_it_is = readings_[first];
    for (std::size_t i = first + 1; i < first + kReadings; ++i) {
      const Reading& other = readings_[i];
      const bool was_found =
          found_ && found_->reading == other.as && found_->camera == static_cast<std::uint32_t>(other.camera);
      const double better_by = was_found ? kNoLongerBetterBy : kBetterBy;
      if (as_it_is.count < kMinRead || other.count < kMinRead || other.agreeing < kAgrees ||
          other.agreeing < as_it_is.agreeing + better_by || (best && best->agreeing > other.agreeing)) {
        continue;
      }
      best = Found{other.as, static_cast<std::uint32_t>(other.camera), other.agreeing};
    }
  }
  found_ = best;
}

}  // namespace tubed
