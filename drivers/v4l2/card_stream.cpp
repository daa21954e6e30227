#include "drivers/v4l2/card_stream.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace tubed {

namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::uint32_t kMaxFormats = 64;  // of a card that goes on and on
constexpr double kRateTolerance = 0.9;     // 29.97 Hz are 30

template <std::size_t size>
std::string_view text_of(const std::uint8_t (&field)[size]) {
  const auto* const begin = reinterpret_cast<const char*>(field);
  return {begin, ::strnlen(begin, size)};
}

v4l2_buffer buffer_numbered(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = kCapture;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

std::optional<MonotonicTime> stamp_of(const v4l2_buffer& buffer) {
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    return {};
  }
  return from_ns(buffer.timestamp.tv_sec * 1'000'000'000LL + buffer.timestamp.tv_usec * 1000LL);
}

/// Whole pictures, and both fields of one woven into each other; single fields are half a picture.
bool is_whole(std::uint32_t field) {
  return field == V4L2_FIELD_NONE || field == V4L2_FIELD_ANY || field == V4L2_FIELD_INTERLACED ||
         field == V4L2_FIELD_INTERLACED_TB || field == V4L2_FIELD_INTERLACED_BT;
}

}  // namespace

bool CardStream::fail(std::string_view doing, int error) noexcept {
  trouble_ = describe_card_error(request_.path, doing, error);
  error_ = error;
  return false;
}

bool CardStream::refuse(const CardWords& words) noexcept {
  trouble_.clear();
  trouble_.printable(request_.path) << words.text();
  error_ = EINVAL;
  return false;
}

bool CardStream::start() noexcept {
  stop();
  trouble_.clear();
  error_ = 0;
  std::uint32_t type = kCapture;
  if (open_device() && choose_input() && follow_signal() && choose_format() && take_buffers()) {
    const int error = device_->control(VIDIOC_STREAMON, &type);
    is_streaming_ = error == 0 || fail("starting its pictures", error);
  }
  if (!is_streaming_) {
    stop();
  }
  return is_streaming_;
}

void CardStream::stop() noexcept {
  std::uint32_t type = kCapture;
  if (is_streaming_) {
    device_->control(VIDIOC_STREAMOFF, &type);
  }
  is_streaming_ = false;
  for (auto& buffer : buffers_) {
    if (!buffer.empty()) {
      device_->unmap(std::exchange(buffer, {}));
    }
  }
  device_->close();
}

bool CardStream::open_device() noexcept {
  if (const int error = device_->open(request_.path.c_str()); error != 0) {
    return fail("opening it", error);
  }
  v4l2_capability card{};
  if (const int error = device_->control(VIDIOC_QUERYCAP, &card); error != 0) {
    return fail("asking what it is", error);
  }
  const std::uint32_t can =
      (card.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? card.device_caps : card.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    return refuse(
        CardWords(" captures no video that is read here (an output, metadata, or several planes a "
                  "picture): choose another device; `tubectl doctor` lists the cards"));
  }
  const std::string_view driver = text_of(card.driver);
  is_simulated_ = driver == "vivid" || driver == "vimc" || driver == "v4l2 loopback";
  return true;
}

bool CardStream::choose_input() noexcept {
  int number = request_.input.value_or(0);
  const int error =
      request_.input ? device_->control(VIDIOC_S_INPUT, &number) : device_->control(VIDIOC_G_INPUT, &number);
  if (request_.input && error == EINVAL) {
    return refuse(CardWords(" has no input ") << number << ": correct input; `tubectl doctor` lists them");
  }
  if (request_.input && error != 0) {
    return fail("choosing its input", error);
  }
  input_ = {};
  input_.index = static_cast<std::uint32_t>(number);
  if (error != 0 || device_->control(VIDIOC_ENUMINPUT, &input_) != 0) {
    input_ = {};  // a card that knows no inputs has one
  }
  const std::uint32_t trouble = trouble_of(input_.status);
  return trouble == 0 || fail("finding a signal", trouble == V4L2_IN_ST_NO_SIGNAL ? ENOLINK : ENOLCK);
}

std::uint32_t CardStream::trouble_of(std::uint32_t status) noexcept {
  if ((status & (V4L2_IN_ST_NO_SIGNAL | V4L2_IN_ST_NO_POWER)) != 0) {
    return V4L2_IN_ST_NO_SIGNAL;
  }
  return (status & (V4L2_IN_ST_NO_SYNC | V4L2_IN_ST_NO_H_LOCK | V4L2_IN_ST_NO_V_LOCK)) != 0
             ? V4L2_IN_ST_NO_SYNC
             : 0;
}

// A digital input takes the signal's timings when it is told to, and a format only after that.
bool CardStream::follow_signal() noexcept {
  v4l2_event_subscription changes{};
  changes.type = V4L2_EVENT_SOURCE_CHANGE;
  changes.id = input_.index;
  device_->control(VIDIOC_SUBSCRIBE_EVENT, &changes);  // a card that knows none is looked at by its pictures
  if ((input_.capabilities & V4L2_IN_CAP_DV_TIMINGS) == 0) {
    return true;
  }
  v4l2_dv_timings timings{};
  const int error = device_->control(VIDIOC_QUERY_DV_TIMINGS, &timings);
  if (error == ENOTTY || error == ENODATA) {
    return true;
  }
  if (error != 0) {
    return fail("finding a signal", error);
  }
  const int refused = device_->control(VIDIOC_S_DV_TIMINGS, &timings);
  return refused == 0 || fail("taking the signal's size and rate", refused);
}

bool CardStream::offers(std::uint32_t fourcc) noexcept {
  v4l2_fmtdesc format{};
  format.type = kCapture;
  for (; format.index < kMaxFormats && device_->control(VIDIOC_ENUM_FMT, &format) == 0; ++format.index) {
    if (format.pixelformat == fourcc) {
      return true;
    }
  }
  return false;
}

// A card may offer the size at the rate in one format only: uncompressed pictures do not fit through USB.
bool CardStream::choose_format() noexcept {
  if (request_.format && !offers(facts_of(*request_.format).fourcc)) {
    return refuse(CardWords(" does not offer format ")
                  << facts_of(*request_.format).word << ": correct format; `tubectl doctor` lists them");
  }
  bool is_set = false;
  for (const double tolerance : {kRateTolerance, 0.0}) {
    for (const PixelFormatFacts& facts : pixel_formats()) {
      const bool is_wanted = request_.format ? facts.format == *request_.format : offers(facts.fourcc);
      if (is_wanted && set_format(facts.format)) {
        set_rate();
        is_set = true;
        if (rate_hz_ == 0 || rate_hz_ >= tolerance * request_.rate_hz) {
          return true;
        }
      }
    }
  }
  if (!is_set && error_ == 0) {
    return refuse(CardWords(" offers no format that is read here; `tubectl doctor` lists what it offers"));
  }
  return is_set;
}

bool CardStream::set_format(PixelFormat format) noexcept {
  v4l2_format asked{};
  asked.type = kCapture;
  if (const int error = device_->control(VIDIOC_G_FMT, &asked); error != 0) {
    return fail("asking for its format", error);
  }
  v4l2_pix_format& pix = asked.fmt.pix;
  const bool is_any = request_.size.width == 0;
  const std::uint32_t width = is_any ? pix.width : static_cast<std::uint32_t>(request_.size.width);
  const std::uint32_t height = is_any ? pix.height : static_cast<std::uint32_t>(request_.size.height);
  pix = {};
  pix.width = width;
  pix.height = height;
  pix.pixelformat = facts_of(format).fourcc;
  pix.field = V4L2_FIELD_NONE;
  if (const int error = device_->control(VIDIOC_S_FMT, &asked); error != 0) {
    return fail("setting its format", error);
  }
  if (pixel_format_of_fourcc(pix.pixelformat) != format || pix.width > GreyConverter::kMaxSide ||
      pix.height > GreyConverter::kMaxSide || !is_whole(pix.field)) {
    return refuse(CardWords(" was asked for format ")
                  << facts_of(format).word << " and gives another, or single fields: choose another format");
  }
  picture_ = {format, {static_cast<int>(pix.width), static_cast<int>(pix.height)}, pix.bytesperline};
  is_interlaced_ = pix.field != V4L2_FIELD_NONE && pix.field != V4L2_FIELD_ANY;
  if (pix.width != width || pix.height != height) {
    return refuse(CardWords(" gives ") << describe(picture_.size).text() << " pixels, asked for were "
                                       << static_cast<int>(width) << " x " << static_cast<int>(height)
                                       << ": correct size and camera, or the console's output");
  }
  return true;
}

void CardStream::set_rate() noexcept {
  v4l2_streamparm stream{};
  stream.type = kCapture;
  v4l2_fract& period = stream.parm.capture.timeperframe;
  if (request_.rate_hz > 0) {
    period = {1000, static_cast<std::uint32_t>(request_.rate_hz * 1000)};
    device_->control(VIDIOC_S_PARM, &stream);
    stream = {};
    stream.type = kCapture;
  }
  const bool is_said = device_->control(VIDIOC_G_PARM, &stream) == 0 && period.numerator > 0;
  rate_hz_ = is_said ? static_cast<double>(period.denominator) / period.numerator : 0;
}

bool CardStream::take_buffers() noexcept {
  v4l2_requestbuffers wanted{};
  wanted.count = static_cast<std::uint32_t>(std::clamp(request_.buffers, 2, kMaxBuffers));
  wanted.type = kCapture;
  wanted.memory = V4L2_MEMORY_MMAP;
  if (const int error = device_->control(VIDIOC_REQBUFS, &wanted); error != 0) {
    return fail("asking for its buffers", error);
  }
  const std::uint32_t count = std::min<std::uint32_t>(wanted.count, kMaxBuffers);
  for (std::uint32_t index = 0; index < count; ++index) {
    v4l2_buffer buffer = buffer_numbered(index);
    if (const int error = device_->control(VIDIOC_QUERYBUF, &buffer); error != 0) {
      return fail("asking for its buffers", error);
    }
    buffers_[index] = device_->map(buffer.length, buffer.m.offset);
    if (buffers_[index].empty()) {
      return fail("mapping its buffers", ENOMEM);
    }
    if (const int error = device_->control(VIDIOC_QBUF, &buffer); error != 0) {
      return fail("handing it its buffers", error);
    }
  }
  return count > 0 || fail("asking for its buffers", ENOMEM);
}

bool CardStream::has_changed() noexcept {
  v4l2_event event{};
  return device_->control(VIDIOC_DQEVENT, &event) == 0 && event.type == V4L2_EVENT_SOURCE_CHANGE;
}

CardStream::Arrival CardStream::take(ArrivedPicture& picture) noexcept {
  if (!is_streaming_) {
    return Arrival::kStopped;
  }
  if (has_changed()) {
    refuse(CardWords(": the signal at its input has changed: it is set up anew"));
    stop();
    return Arrival::kStopped;
  }
  v4l2_buffer buffer = buffer_numbered(0);
  const int error = device_->control(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) {
    return Arrival::kNothing;
  }
  if (error != 0 || buffer.index >= buffers_.size()) {
    fail("taking a picture", error == 0 ? EIO : error);
    stop();
    return Arrival::kStopped;
  }
  const auto& memory = buffers_[buffer.index];
  picture = {buffer.index, memory.first(std::min<std::size_t>(buffer.bytesused, memory.size())),
             buffer.sequence, stamp_of(buffer), (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0};
  return Arrival::kPicture;
}

void CardStream::give_back(const ArrivedPicture& picture) noexcept {
  v4l2_buffer buffer = buffer_numbered(picture.buffer);
  if (is_streaming_) {
    device_->control(VIDIOC_QBUF, &buffer);  // one that is lost here is missed as silence
  }
}

bool CardStream::has_signal() noexcept {
  v4l2_input input{};
  input.index = input_.index;
  if (!is_streaming_ || device_->control(VIDIOC_ENUMINPUT, &input) != 0 || trouble_of(input.status) == 0) {
    return true;
  }
  fail("finding a signal", trouble_of(input.status) == V4L2_IN_ST_NO_SIGNAL ? ENOLINK : ENOLCK);
  stop();
  return false;
}

}  // namespace tubed
