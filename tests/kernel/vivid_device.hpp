// The kernel's video device that hands what is written to one node out of another (vivid), and its faults.
#pragma once

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace tubed {

/// One node of it, held open.
class VividNode {
 public:
  explicit VividNode(const std::string& path) : descriptor_(::open(path.c_str(), O_RDWR | O_CLOEXEC)) {
    if (descriptor_ < 0) {
      throw std::system_error(errno, std::generic_category(), path);
    }
  }
  ~VividNode() { ::close(descriptor_); }
  VividNode(const VividNode&) = delete;
  VividNode& operator=(const VividNode&) = delete;

  template <typename Argument>
  void call(unsigned long request, Argument&& argument) {
    if (::ioctl(descriptor_, request, &argument) != 0) {
      throw std::system_error(errno, std::generic_category(), "ioctl " + std::to_string(request & 0xFF));
    }
  }
  /// Sets a control by its name, as `v4l2-ctl -L` shows it.
  void set(const std::string& name, int value) {
    call(VIDIOC_S_CTRL, v4l2_control{control_named(name).id, value});
  }
  /// The first choice of a menu whose words begin like that.
  void set_choice(const std::string& name, const std::string& words) {
    const v4l2_queryctrl control = control_named(name);
    for (int choice = control.minimum; choice <= control.maximum; ++choice) {
      v4l2_querymenu menu{};
      menu.id = control.id;
      menu.index = static_cast<std::uint32_t>(choice);
      if (::ioctl(descriptor_, VIDIOC_QUERYMENU, &menu) == 0 &&
          std::string(reinterpret_cast<const char*>(menu.name)).starts_with(words)) {
        set(name, choice);
        return;
      }
    }
    throw std::runtime_error("no choice '" + words + "' of '" + name + "'");
  }
  /// The timings of the signal with so many pixels, as its number among those that the node knows.
  /// `rate_hz`: pictures a second, to 2 %; 0: any.
  int number_of_timings(std::uint32_t width, std::uint32_t height, double rate_hz = 0) {
    v4l2_enum_dv_timings each{};
    while (::ioctl(descriptor_, VIDIOC_ENUM_DV_TIMINGS, &each) == 0) {
      const v4l2_bt_timings& bt = each.timings.bt;
      const double all = (bt.width + bt.hfrontporch + bt.hsync + bt.hbackporch + 0.0) *
                         (bt.height + bt.vfrontporch + bt.vsync + bt.vbackporch);
      const double off_hz = static_cast<double>(bt.pixelclock) / all - rate_hz;
      if (bt.width == width && bt.height == height && bt.interlaced == V4L2_DV_PROGRESSIVE &&
          (rate_hz == 0 || (off_hz < 0.02 * rate_hz && off_hz > -0.02 * rate_hz))) {
        return static_cast<int>(each.index);
      }
      ++each.index;
    }
    throw std::runtime_error("no timings of that size");
  }
  void set_timings(int number) {
    v4l2_enum_dv_timings timings{};
    timings.index = static_cast<std::uint32_t>(number);
    call(VIDIOC_ENUM_DV_TIMINGS, timings);
    call(VIDIOC_S_DV_TIMINGS, timings.timings);
  }
  /// Of V4L2_BUF_TYPE_VIDEO_CAPTURE or _OUTPUT; what was taken.
  v4l2_pix_format set_format(std::uint32_t type, std::uint32_t fourcc, std::uint32_t width,
                             std::uint32_t height) {
    v4l2_format format{};
    format.type = type;
    format.fmt.pix.width = width;
    format.fmt.pix.height = height;
    format.fmt.pix.pixelformat = fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (::ioctl(descriptor_, VIDIOC_S_FMT, &format) != 0) {
      throw std::system_error(errno, std::generic_category(), "VIDIOC_S_FMT");
    }
    return format.fmt.pix;
  }
  void share_memory(v4l2_buffer& buffer, std::vector<std::uint8_t*>& memory) {
    call(VIDIOC_QUERYBUF, buffer);
    void* const at = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_,
                            static_cast<off_t>(buffer.m.offset));
    if (at == MAP_FAILED) {
      throw std::system_error(errno, std::generic_category(), "mmap");
    }
    memory.push_back(static_cast<std::uint8_t*>(at));
  }

 private:
  v4l2_queryctrl control_named(const std::string& name) {
    v4l2_queryctrl control{};
    control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (::ioctl(descriptor_, VIDIOC_QUERYCTRL, &control) == 0) {
      if (name == reinterpret_cast<const char*>(control.name)) {
        return control;
      }
      control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    throw std::runtime_error("no control '" + name + "'");
  }

  int descriptor_;
};

/// The output node, which shows what is written to it.
class VividConsole {
 public:
  VividConsole(int timings, std::uint32_t width, std::uint32_t height) : node_("/dev/video1") {
    node_.set_timings(timings);
    const v4l2_pix_format format =
        node_.set_format(V4L2_BUF_TYPE_VIDEO_OUTPUT, V4L2_PIX_FMT_GREY, width, height);
    if (format.width != width || format.height != height || format.bytesperline != width) {
      throw std::runtime_error("the output node has another size");
    }
    picture_bytes_ = std::size_t{width} * height;
    v4l2_requestbuffers wanted{};
    wanted.count = 4;
    wanted.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    wanted.memory = V4L2_MEMORY_MMAP;
    node_.call(VIDIOC_REQBUFS, wanted);
    for (std::uint32_t index = 0; index < wanted.count; ++index) {
      v4l2_buffer buffer = buffer_numbered(index);
      node_.share_memory(buffer, memory_);
    }
  }
  ~VividConsole() {
    for (std::uint8_t* const memory : memory_) {  // which would keep the node open
      ::munmap(memory, picture_bytes_);
    }
  }
  VividConsole(const VividConsole&) = delete;
  VividConsole& operator=(const VividConsole&) = delete;

  /// The newest in its queue is not shown before the next has come: `picture` fills all of it.
  void show(const std::vector<std::uint8_t>& picture) {
    for (std::size_t count = 0; count < memory_.size(); ++count) {
      v4l2_buffer buffer = buffer_numbered(static_cast<std::uint32_t>(count));
      if (is_streaming_) {
        node_.call(VIDIOC_DQBUF, buffer);
      }
      std::memcpy(memory_.at(buffer.index), picture.data(), picture_bytes_);
      buffer.bytesused = static_cast<std::uint32_t>(picture_bytes_);
      buffer.field = V4L2_FIELD_NONE;
      node_.call(VIDIOC_QBUF, buffer);
    }
    if (!is_streaming_) {
      node_.call(VIDIOC_STREAMON, int{V4L2_BUF_TYPE_VIDEO_OUTPUT});
      is_streaming_ = true;
    }
  }

 private:
  static v4l2_buffer buffer_numbered(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
  }

  VividNode node_;
  std::size_t picture_bytes_ = 0;
  std::vector<std::uint8_t*> memory_;
  bool is_streaming_ = false;
};

}  // namespace tubed
