// A capture card without a kernel: what V4L2 promises, and every fault of a card on request, by a clock of
// its own.
#pragma once

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "drivers/v4l2/video_device.hpp"

namespace tubed {

/// The card; outlives the device that drives it.
struct FakeCard {
  // What it is.
  std::string driver = "fakecard";
  std::string name = "Fake Card";  ///< at most 31 bytes
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_GREY};
  std::function<bool(std::uint32_t fourcc, int width, int height)> has_size = [](auto...) { return true; };
  std::function<double(std::uint32_t fourcc)> rate_hz = [](std::uint32_t) { return 30.0; };
  std::uint32_t input_capabilities = 0;
  std::uint32_t field = V4L2_FIELD_NONE;
  int width = 96;  ///< of its signal
  int height = 64;
  std::uint32_t padding = 0;  ///< bytes behind each row

  // What is wrong with it.
  bool is_plugged = true;
  int open_error = 0;
  std::set<unsigned long> failing{};  ///< requests that answer EIO
  std::uint32_t input_status = 0;
  int timings_error = 0;
  bool hangs = false;  ///< it streams and has no pictures
  bool wakes_for_nothing = false;
  std::uint32_t next_flags = 0;  ///< of the pictures to come
  std::uint32_t lose_next = 0;   ///< so many pictures are lost
  std::uint32_t stamp_kind = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  std::chrono::nanoseconds stamp_shift{};
  std::size_t short_by = 0;  ///< bytes missing at a picture's end
  bool signal_changed = false;
  std::uint32_t shows_each = 1;  ///< so many pictures are the same

  // What it does.
  MonotonicTime time = from_ns(5'000'000'000);
  MonotonicTime next_picture{};
  std::uint32_t sequence = 0;
  std::uint32_t shown = 0;
  bool is_open = false;
  bool streams = false;
  v4l2_pix_format pix{};
  std::vector<std::vector<std::uint8_t>> buffers;
  std::deque<std::uint32_t> queued;
  std::deque<v4l2_buffer> filled;
  int opens = 0;
  int wakes = 0;

  [[nodiscard]] std::chrono::nanoseconds period() const {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate_hz(pix.pixelformat)));
  }
  /// The value of every pixel's first byte of picture `number`.
  static std::uint8_t value_of(std::uint32_t number) { return static_cast<std::uint8_t>(17 * number + 1); }

  void expose() {
    const std::uint32_t number = sequence++;
    shown = number % shows_each == 0 ? number : shown;
    if (lose_next > 0 || queued.empty()) {
      lose_next -= lose_next > 0 ? 1 : 0;
      return;
    }
    v4l2_buffer buffer{};
    buffer.index = queued.front();
    queued.pop_front();
    std::fill(buffers[buffer.index].begin(), buffers[buffer.index].end(), value_of(shown));
    buffer.bytesused = pix.sizeimage - static_cast<std::uint32_t>(short_by);
    buffer.sequence = number;
    buffer.flags = next_flags | stamp_kind;
    const std::int64_t stamp_us = to_ns(time + stamp_shift) / 1000;
    buffer.timestamp = {stamp_us / 1'000'000, stamp_us % 1'000'000};
    filled.push_back(buffer);
  }
  /// Lets the time go on to `until`, with its pictures.
  void run_to(MonotonicTime until) {
    while (streams && is_plugged && !hangs && next_picture <= until) {
      time = next_picture;
      next_picture += period();
      expose();
    }
    next_picture = hangs ? std::max(next_picture, until + period()) : next_picture;
    time = std::max(time, until);
  }
};

class FakeVideoDevice final : public VideoDevice {
 public:
  explicit FakeVideoDevice(FakeCard& card) : card_(card) {}
  ~FakeVideoDevice() override { EXPECT_FALSE(card_.is_open) << "the device was left open"; }

  int open(const char* /*path*/) noexcept override {
    EXPECT_FALSE(card_.is_open);
    if (!card_.is_plugged || card_.open_error != 0) {
      return card_.is_plugged ? card_.open_error : ENOENT;
    }
    card_.is_open = true;
    was_unplugged_ = false;
    ++card_.opens;
    return 0;
  }
  void close() noexcept override {
    card_.is_open = card_.streams = false;
    card_.queued.clear();
    card_.filled.clear();
    EXPECT_EQ(mapped_, 0) << "buffers were left mapped";
    card_.buffers.clear();
  }
  std::span<const std::uint8_t> map(std::size_t bytes, std::uint32_t offset) noexcept override {
    ++mapped_;
    return std::span(card_.buffers.at(offset)).first(bytes);
  }
  void unmap(std::span<const std::uint8_t> buffer) noexcept override {
    --mapped_;
    for (auto& one : card_.buffers) {
      if (one.data() == buffer.data()) {
        one = {};  // who reads it now reads what was freed: the address sanitizer tells
      }
    }
  }
  void wait(MonotonicTime deadline) noexcept override {
    ++card_.wakes;
    card_.time += std::chrono::nanoseconds(card_.wakes_for_nothing ? 10'000 : 0);
    if (!card_.is_plugged || card_.signal_changed || card_.wakes_for_nothing || !card_.filled.empty()) {
      return;
    }
    card_.run_to(card_.hangs || !card_.streams ? deadline : std::min(deadline, card_.next_picture));
  }
  void sleep(MonotonicTime deadline) noexcept override { card_.run_to(deadline); }
  [[nodiscard]] MonotonicTime now() noexcept override { return card_.time; }

  int control(unsigned long request, void* argument) noexcept override {
    EXPECT_TRUE(card_.is_open) << "a call to a device that is not open";
    was_unplugged_ = was_unplugged_ || !card_.is_plugged;
    if (was_unplugged_) {
      return ENODEV;
    }
    return card_.failing.contains(request) ? EIO : answer(request, argument);
  }

 private:
  int answer(unsigned long request, void* argument) noexcept {
    switch (request) {
      case VIDIOC_QUERYCAP:
        return describe(*static_cast<v4l2_capability*>(argument));
      case VIDIOC_G_INPUT:
        *static_cast<int*>(argument) = 0;
        return 0;
      case VIDIOC_S_INPUT:
        return *static_cast<int*>(argument) == 0 ? 0 : EINVAL;
      case VIDIOC_ENUMINPUT: {
        auto& input = *static_cast<v4l2_input*>(argument);
        input.capabilities = card_.input_capabilities;
        input.status = card_.input_status;
        return input.index == 0 ? 0 : EINVAL;
      }
      case VIDIOC_QUERY_DV_TIMINGS:
        return card_.timings_error;
      case VIDIOC_S_DV_TIMINGS:
      case VIDIOC_SUBSCRIBE_EVENT:
        return 0;
      case VIDIOC_DQEVENT:
        return take_event(*static_cast<v4l2_event*>(argument));
      default:
        return answer_about_format(request, argument);
    }
  }
  int answer_about_format(unsigned long request, void* argument) noexcept {
    switch (request) {
      case VIDIOC_ENUM_FMT: {
        auto& format = *static_cast<v4l2_fmtdesc*>(argument);
        if (format.index >= card_.formats.size()) {
          return EINVAL;
        }
        format.pixelformat = card_.formats[format.index];
        return 0;
      }
      case VIDIOC_G_FMT: {
        auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        pix = card_.pix;
        pix.width = static_cast<std::uint32_t>(card_.width);
        pix.height = static_cast<std::uint32_t>(card_.height);
        return 0;
      }
      case VIDIOC_ENUM_FRAMESIZES: {
        auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
        size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
        size.discrete = {static_cast<std::uint32_t>(card_.width), static_cast<std::uint32_t>(card_.height)};
        return size.index == 0 ? 0 : EINVAL;
      }
      case VIDIOC_ENUM_FRAMEINTERVALS: {
        auto& interval = *static_cast<v4l2_frmivalenum*>(argument);
        interval.type = V4L2_FRMIVAL_TYPE_DISCRETE;
        interval.discrete = {1, static_cast<std::uint32_t>(card_.rate_hz(interval.pixel_format))};
        return interval.index == 0 ? 0 : EINVAL;
      }
      case VIDIOC_S_FMT:
        return set_format(static_cast<v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_S_PARM:
        return 0;
      case VIDIOC_G_PARM:
        static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {
            1000, static_cast<std::uint32_t>(1000 * card_.rate_hz(card_.pix.pixelformat))};
        return 0;
      default:
        return answer_about_buffers(request, argument);
    }
  }
  int answer_about_buffers(unsigned long request, void* argument) noexcept {
    auto& buffer = *static_cast<v4l2_buffer*>(argument);
    switch (request) {
      case VIDIOC_REQBUFS: {
        auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
        card_.buffers.assign(wanted.count, std::vector<std::uint8_t>(card_.pix.sizeimage));
        return 0;
      }
      case VIDIOC_QUERYBUF:
        buffer.length = card_.pix.sizeimage;
        buffer.m.offset = buffer.index;
        return 0;
      case VIDIOC_QBUF:
        EXPECT_EQ(std::count(card_.queued.begin(), card_.queued.end(), buffer.index), 0);
        card_.queued.push_back(buffer.index);
        return 0;
      case VIDIOC_DQBUF:
        if (card_.filled.empty()) {
          return EAGAIN;
        }
        buffer = card_.filled.front();
        card_.filled.pop_front();
        return 0;
      case VIDIOC_STREAMON:
        card_.streams = true;
        card_.sequence = 0;
        card_.next_picture = card_.time + card_.period();
        return 0;
      case VIDIOC_STREAMOFF:
        card_.streams = false;
        return 0;
      default:
        ADD_FAILURE() << "a request that no card knows: " << request;
        return ENOTTY;
    }
  }
  int describe(v4l2_capability& card) noexcept {
    std::memcpy(card.card, card_.name.data(), card_.name.size());
    std::memcpy(card.driver, card_.driver.data(), card_.driver.size());
    card.capabilities = card_.capabilities;
    return 0;
  }
  int take_event(v4l2_event& event) noexcept {
    event.type = V4L2_EVENT_SOURCE_CHANGE;
    return std::exchange(card_.signal_changed, false) ? 0 : ENOENT;
  }
  int set_format(v4l2_pix_format& pix) noexcept {
    EXPECT_TRUE(card_.buffers.empty()) << "a format set while there are buffers: EBUSY";
    if (std::find(card_.formats.begin(), card_.formats.end(), pix.pixelformat) == card_.formats.end()) {
      pix.pixelformat = card_.formats.front();
    }
    if (!card_.has_size(pix.pixelformat, static_cast<int>(pix.width), static_cast<int>(pix.height))) {
      pix.width = static_cast<std::uint32_t>(card_.width);
      pix.height = static_cast<std::uint32_t>(card_.height);
    }
    const bool is_deep = pix.pixelformat == V4L2_PIX_FMT_Y16 || pix.pixelformat == V4L2_PIX_FMT_YUYV;
    pix.bytesperline = pix.width * (is_deep ? 2 : 1) + card_.padding;
    pix.sizeimage = pix.bytesperline * pix.height;
    pix.field = card_.field;
    card_.pix = pix;
    return 0;
  }

  FakeCard& card_;
  int mapped_ = 0;
  bool was_unplugged_ = false;  ///< since it was opened
};

}  // namespace tubed
