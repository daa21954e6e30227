#include "drivers/v4l2/v4l2_image_source.hpp"

#include <algorithm>
#include <cerrno>

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kBetweenTries{100};
constexpr seconds kMaxBackOff{2};
constexpr milliseconds kBetweenLooks{50};  // for a signal
constexpr milliseconds kLate{60};          // beyond a period; with 30 Hz silence is told after 93 ms
constexpr milliseconds kUnknownPeriod{40};
constexpr seconds kFirstPicture{2};  // a USB device may take so long
constexpr seconds kHung{1};          // then the stream is started anew
constexpr milliseconds kAhead{5};    // that a time stamp may be, by rounding
constexpr seconds kTold{5};          // how long a loss stays in the words
constexpr int kMaxEmptyWakes = 8;    // a broken driver may wake without end and have nothing
constexpr milliseconds kPause{2};

/// Absent, or without a signal: asking again costs nothing.
bool may_come_any_time(int error) {
  return error == ENOENT || error == ENODEV || error == ENXIO || error == ENOLINK || error == ENOLCK;
}

}  // namespace

V4l2ImageSource::V4l2ImageSource(CameraCalibration camera, const V4l2Settings& settings,
                                 std::unique_ptr<VideoDevice> device)
    : camera_(std::move(camera)),
      settings_(settings),
      stream_(std::move(device), settings.request),
      converter_(settings.shape, settings.coding),
      held_(settings.held_noise_levels, masks_of(camera_)),
      back_off_(kBetweenTries) {}

OpenResult V4l2ImageSource::open() {
  next_try_ = {};
  back_off_ = kBetweenTries;
  return {true, {}};
}

void V4l2ImageSource::close() noexcept {
  stream_.stop();
  delivers_ = false;
}

void V4l2ImageSource::wait(MonotonicTime deadline) noexcept {
  VideoDevice& device = stream_.device();
  if (!stream_.is_streaming()) {
    device.sleep(std::min(deadline, next_try_));
  } else if (empty_wakes_ > kMaxEmptyWakes) {
    device.sleep(std::min(deadline, device.now() + kPause));
  } else {
    device.wait(std::min({deadline, last_arrival_ + silence(), next_look_}));
  }
}

ReadOutcome V4l2ImageSource::read(ImageFrame& frame) noexcept {
  const MonotonicTime now = stream_.device().now();
  if (!stream_.is_streaming()) {
    try_to_start(now);
    return ReadOutcome::kNothing;
  }
  ArrivedPicture newest;
  ReadOutcome outcome = ReadOutcome::kNothing;
  if (take_newest(newest, now)) {
    outcome = deliver(newest, frame, now);
    stream_.give_back(newest);
  }
  if (stream_.is_streaming()) {
    look_after(now);
  }
  return outcome;
}

void V4l2ImageSource::try_to_start(MonotonicTime now) noexcept {
  if (now < next_try_) {
    return;
  }
  if (!stream_.start() || !fits()) {
    lose(stream_.is_streaming() ? trouble_ : stream_.trouble(), now);
    return;
  }
  ++counts_.starts;
  sequence_.reset();
  is_silent_ = false;
  refusal_ = {};
  last_arrival_ = stream_.device().now();
  next_look_ = last_arrival_ + kBetweenLooks;
  trouble_.clear();
  trouble_.printable(settings_.request.path) << " was started, no picture yet";
}

/// Do the card's pictures become those of the camera? If not, trouble_ says so.
bool V4l2ImageSource::fits() noexcept {
  const PictureSize camera{camera_.width, camera_.height};
  const bool is_read = converter_.begin(stream_.picture());
  if (is_read && converter_.size() == camera) {
    held_.begin(camera, converter_.depth());
    return true;
  }
  trouble_.clear();
  trouble_.printable(settings_.request.path)
      << " gives " << describe(stream_.picture().size).text() << " pixels";
  if (is_read) {
    trouble_ << ", which become " << describe(converter_.size()).text() << "; camera " << camera_.name
             << " has " << describe(camera).text()
             << ": correct size, crop or camera, or the console's output";
  } else {
    trouble_ << ": " << converter_.why();
  }
  return false;
}

/// False: there is none, or the stream has ended.
bool V4l2ImageSource::take_newest(ArrivedPicture& newest, MonotonicTime now) noexcept {
  bool has_one = false;
  for (int taken = 0; taken < CardStream::kMaxBuffers; ++taken) {
    ArrivedPicture picture;
    switch (stream_.take(picture)) {
      case CardStream::Arrival::kPicture:
        if (has_one) {
          stream_.give_back(newest);
          ++counts_.overtaken;
        }
        newest = picture;
        has_one = true;
        count(picture, now);
        break;
      case CardStream::Arrival::kNothing:
        empty_wakes_ = has_one ? 0 : empty_wakes_ + 1;
        return has_one;
      case CardStream::Arrival::kStopped:
        lose(stream_.trouble(), now);
        return false;  // its buffers have gone
    }
  }
  return has_one;
}

void V4l2ImageSource::count(const ArrivedPicture& picture, MonotonicTime now) noexcept {
  const std::uint32_t gap = sequence_ ? picture.sequence - *sequence_ - 1 : 0;
  if (gap > 0 && gap < 1U << 31U) {
    counts_.lost += gap;
    frame_number_ += gap;
    last_loss_ = now;
  }
  ++frame_number_;
  sequence_ = picture.sequence;
  last_arrival_ = now;
  empty_wakes_ = 0;
}

ReadOutcome V4l2ImageSource::refuse(std::string_view why) noexcept {
  refusal_ = why;
  ++counts_.refused;
  return ReadOutcome::kRefused;
}

ReadOutcome V4l2ImageSource::deliver(const ArrivedPicture& picture, ImageFrame& frame,
                                     MonotonicTime now) noexcept {
  // Some drivers work their stamps out beforehand: nothing was exposed after it had come.
  const MonotonicTime exposure = std::min(picture.stamp.value_or(now), now);
  if (picture.is_damaged) {
    return refuse("the card says that it is damaged");
  }
  if (exposure <= newest_exposure_) {
    return refuse("its time stamp is not after that of the one before");
  }
  if (!converter_.convert(picture.bytes, frame.pixels)) {
    return refuse(converter_.why());
  }
  has_stamps_ = picture.stamp.has_value();
  last_ahead_ = picture.stamp > now + kAhead ? now : last_ahead_;
  const bool is_new = !is_held(frame, now);
  newest_exposure_ = exposure;
  frame.exposure = exposure;
  frame.frame_number = frame_number_;
  frame.origin = stream_.is_simulated() ? Origin::kSimulated : Origin::kDevice;
  frame.fluoroscopy_on = is_new;
  frame.width = camera_.width;
  frame.height = camera_.height;
  frame.depth = converter_.depth();
  frame.received = stream_.device().now();
  refusal_ = {};
  is_silent_ = false;
  delivers_ = has_delivered_ = true;
  last_delivery_ = now;
  back_off_ = kBetweenTries;
  const bool is_delivered = is_new || now - last_new_ >= settings_.held_after;
  ++(is_new ? counts_.pictures : counts_.held);
  return is_delivered ? ReadOutcome::kFrame : ReadOutcome::kNothing;
}

/// Does the picture only show the one before again?
bool V4l2ImageSource::is_held(const ImageFrame& frame, MonotonicTime now) noexcept {
  if (settings_.held_after.count() > 0 && !held_.is_new(frame.pixels)) {
    return true;
  }
  last_new_ = now;
  return false;
}

std::chrono::nanoseconds V4l2ImageSource::silence() const noexcept {
  if (!delivers_ && last_delivery_ < last_arrival_) {
    return kFirstPicture;
  }
  const double rate_hz = stream_.rate_hz();
  const auto period = rate_hz > 0 ? std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate_hz))
                                  : std::chrono::nanoseconds(kUnknownPeriod);
  return std::clamp<std::chrono::nanoseconds>(period + kLate, kLate, kFirstPicture);
}

void V4l2ImageSource::look_after(MonotonicTime now) noexcept {
  if (now >= next_look_) {
    next_look_ = now + kBetweenLooks;
    if (!stream_.has_signal()) {
      lose(stream_.trouble(), now);
      return;
    }
  }
  if (delivers_ && now - last_delivery_ >= silence()) {
    is_silent_ = true;
    delivers_ = false;
  }
  if (now - last_arrival_ >= std::max<std::chrono::nanoseconds>(kHung, silence())) {
    CardWords hung;
    hung.printable(settings_.request.path)
        << " has no picture though its stream runs: its driver hangs, or the signal stands still";
    lose(hung, now);
  }
}

void V4l2ImageSource::lose(const CardWords& why, MonotonicTime now) noexcept {
  const bool is_refused = stream_.is_streaming();
  trouble_ = why;
  stream_.stop();
  delivers_ = false;
  if (!is_refused && may_come_any_time(stream_.error())) {
    back_off_ = kBetweenTries;
    next_try_ = now + kBetweenTries;
    return;
  }
  next_try_ = stream_.device().now() + back_off_;
  back_off_ = std::min<std::chrono::nanoseconds>(2 * back_off_, kMaxBackOff);
}

SourceCondition V4l2ImageSource::condition() noexcept {
  SourceCondition condition;
  const MonotonicTime now = stream_.device().now();
  condition.state = delivers_        ? DeviceState::kRunning
                    : has_delivered_ ? DeviceState::kReconnecting
                                     : DeviceState::kStarting;
  if (!stream_.is_streaming()) {
    condition.words = trouble_;
  } else if (!refusal_.empty()) {
    condition.words << "a picture of " << settings_.request.path << " was refused: " << refusal_;
  } else if (delivers_) {
    condition.words = note(now);
  } else if (is_silent_) {
    condition.words
        << settings_.request.path
        << " has no picture: its driver hangs, or the signal stands still; started anew after 1 s";
  } else {
    condition.words = trouble_;
  }
  return condition;
}

/// What a person should know of a card that delivers.
CardWords V4l2ImageSource::note(MonotonicTime now) const noexcept {
  CardWords words;
  const auto say = [&](std::string_view text) { words << (words.empty() ? "" : "; ") << text; };
  if (counts_.lost > 0 && now - last_loss_ < kTold) {
    say("pictures are lost: USB bandwidth, or a machine that is too slow");
  }
  if (!has_stamps_) {
    say("the card has no time stamps of CLOCK_MONOTONIC: arrival is taken for the exposure, see "
        "time_offset_ms");
  }
  if (last_ahead_ > MonotonicTime{} && now - last_ahead_ < kTold) {
    say("the card's time stamps lie ahead of their arrival, which is taken instead");
  }
  if (stream_.is_interlaced() && settings_.shape.fields == FieldUse::kBoth) {
    say("pictures are interlaced, what moves has combs: set the console to progressive, or use one of the "
        "fields");
  }
  if (settings_.request.rate_hz > 0 && stream_.rate_hz() > 0 &&
      stream_.rate_hz() < 0.9 * settings_.request.rate_hz) {
    say("fewer pictures a second than rate_hz: ");
    words << static_cast<int>(stream_.rate_hz());
  }
  return words;
}

}  // namespace tubed
