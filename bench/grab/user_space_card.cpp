#include "bench/grab/user_space_card.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <sstream>

namespace tubed {

namespace {

constexpr std::uint32_t kMaxBuffers = 16;
constexpr std::uint32_t kOffsetStep = 1U << 26U;

std::int64_t clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

std::vector<std::vector<std::uint8_t>> read_pictures(const std::string& path) {
  std::vector<std::vector<std::uint8_t>> pictures;
  if (std::FILE* file = std::fopen(path.c_str(), "rb")) {
    for (std::uint32_t bytes = 0; std::fread(&bytes, sizeof bytes, 1, file) == 1;) {
      pictures.emplace_back(bytes);
      if (std::fread(pictures.back().data(), 1, bytes, file) != bytes) pictures.pop_back();
    }
    std::fclose(file);
  }
  return pictures;
}

}  // namespace

UserSpaceCard::UserSpaceCard(const std::string& words) {
  std::istringstream text(words);
  std::string width, height, rate, pictures;
  for (std::string* const word : {&path_, &width, &height, &fourcc_, &rate, &pictures})
    std::getline(text, *word, ',');
  width_ = static_cast<std::uint32_t>(std::atoi(width.c_str()));
  height_ = static_cast<std::uint32_t>(std::atoi(height.c_str()));
  rate_hz_ = static_cast<std::uint32_t>(std::atoi(rate.c_str()));
  pictures_ = read_pictures(pictures);
  for (const auto& picture : pictures_) size_ = std::max(size_, static_cast<std::uint32_t>(picture.size()));
  fourcc_.resize(4, ' ');
}

bool UserSpaceCard::is(int file) const {
  struct stat other {};
  return file_ >= 0 && (file == file_ ||
                        (::fstat(file, &other) == 0 && S_ISCHR(other.st_mode) && other.st_rdev == terminal_));
}

int UserSpaceCard::open(int flags) {
  bell_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (bell_ < 0 || grantpt(bell_) != 0 || unlockpt(bell_) != 0) return -1;
  file_ = next_of<int (*)(const char*, int, ...)>("open")(ptsname(bell_), flags | O_NOCTTY);
  struct stat terminal {};
  if (::fstat(file_, &terminal) == 0) terminal_ = terminal.st_rdev;
  termios raw{};
  if (tcgetattr(file_, &raw) == 0) {
    cfmakeraw(&raw);
    tcsetattr(file_, TCSANOW, &raw);
  }
  return file_;
}

void UserSpaceCard::close() {
  stop();
  next_of<int (*)(int)>("close")(bell_);
  bell_ = file_ = -1;
}

void* UserSpaceCard::map(std::int64_t offset) {
  const auto number = static_cast<std::uint32_t>(offset / kOffsetStep);
  return number < buffers_.size() ? static_cast<void*>(buffers_[number].memory.data()) : MAP_FAILED;
}

bool UserSpaceCard::owns(const void* memory) const {
  return std::any_of(buffers_.begin(), buffers_.end(),
                     [memory](const Buffer& buffer) { return buffer.memory.data() == memory; });
}

std::uint32_t UserSpaceCard::pixel_format() const {
  return v4l2_fourcc(static_cast<std::uint32_t>(fourcc_[0]), static_cast<std::uint32_t>(fourcc_[1]),
                     static_cast<std::uint32_t>(fourcc_[2]), static_cast<std::uint32_t>(fourcc_[3]));
}

void UserSpaceCard::describe(std::uint32_t number, v4l2_buffer& out) const {
  const Buffer& buffer = buffers_[number];
  out.index = number;
  out.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  out.memory = V4L2_MEMORY_MMAP;
  out.m.offset = number * kOffsetStep;
  out.length = size_;
  out.bytesused = buffer.used;
  out.field = V4L2_FIELD_NONE;
  out.sequence = buffer.sequence;
  out.timestamp.tv_sec = buffer.stamp_ns / 1'000'000'000;
  out.timestamp.tv_usec = buffer.stamp_ns / 1000 % 1'000'000;
  out.flags = V4L2_BUF_FLAG_MAPPED | V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (buffer.is_filled) out.flags |= V4L2_BUF_FLAG_DONE;
  if (buffer.is_queued) out.flags |= V4L2_BUF_FLAG_QUEUED;
}

int UserSpaceCard::describe_capability(v4l2_capability& out) const {
  out = {};
  std::strcpy(reinterpret_cast<char*>(out.driver), "tubed_card");
  std::strcpy(reinterpret_cast<char*>(out.card), "a card in user space");
  std::strcpy(reinterpret_cast<char*>(out.bus_info), "platform:user");
  out.version = 0x060100;
  out.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  out.capabilities = out.device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

int UserSpaceCard::enumerate(unsigned long request, void* argument) const {
  if (request == VIDIOC_ENUM_FMT) {
    auto& out = *static_cast<v4l2_fmtdesc*>(argument);
    if (out.index > 0 || out.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
    out.flags = fourcc_ == "MJPG" ? V4L2_FMT_FLAG_COMPRESSED : 0;
    out.pixelformat = pixel_format();
    std::strcpy(reinterpret_cast<char*>(out.description), "pictures of a file");
    return 0;
  }
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& out = *static_cast<v4l2_frmsizeenum*>(argument);
    if (out.index > 0 || out.pixel_format != pixel_format()) return EINVAL;
    out.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    out.discrete = {width_, height_};
    return 0;
  }
  auto& out = *static_cast<v4l2_frmivalenum*>(argument);
  if (out.index > 0 || out.pixel_format != pixel_format()) return EINVAL;
  out.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  out.discrete = {1, rate_hz_};
  return 0;
}

int UserSpaceCard::control(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      return describe_capability(*static_cast<v4l2_capability*>(argument));
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumerate(request, argument);
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT:
      return describe_format(*static_cast<v4l2_format*>(argument));
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      return describe_rate(*static_cast<v4l2_streamparm*>(argument));
    case VIDIOC_ENUMINPUT:
      return describe_input(*static_cast<v4l2_input*>(argument));
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_S_INPUT:
      return 0;
    case VIDIOC_REQBUFS:
      return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF:
    case VIDIOC_QBUF:
      return queue(request, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return dequeue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      return stream(true);
    case VIDIOC_STREAMOFF:
      return stream(false);
    default:
      return ENOTTY;
  }
}

int UserSpaceCard::describe_format(v4l2_format& out) const {
  if (out.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
  v4l2_pix_format& pix = out.fmt.pix;
  pix = {};
  pix.width = width_;
  pix.height = height_;
  pix.pixelformat = pixel_format();
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = fourcc_ == "MJPG" ? 0 : size_ / height_;
  pix.sizeimage = size_;
  pix.colorspace = fourcc_ == "MJPG" ? V4L2_COLORSPACE_JPEG : V4L2_COLORSPACE_RAW;
  return 0;
}

int UserSpaceCard::describe_rate(v4l2_streamparm& out) const {
  out.parm.capture = {};
  out.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  out.parm.capture.timeperframe = {1, rate_hz_};
  return 0;
}

int UserSpaceCard::describe_input(v4l2_input& out) {
  if (out.index > 0) return EINVAL;
  out = {};
  out.type = V4L2_INPUT_TYPE_CAMERA;
  std::strcpy(reinterpret_cast<char*>(out.name), "input");
  return 0;
}

int UserSpaceCard::request_buffers(v4l2_requestbuffers& wanted) {
  if (wanted.memory != V4L2_MEMORY_MMAP) return EINVAL;
  stop();
  wanted.count = std::min(wanted.count, kMaxBuffers);
  wanted.capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP;
  buffers_.assign(wanted.count, Buffer{});
  for (Buffer& buffer : buffers_) buffer.memory.resize(size_);
  return 0;
}

int UserSpaceCard::queue(unsigned long request, v4l2_buffer& buffer) {
  if (buffer.index >= buffers_.size() || buffer.memory != V4L2_MEMORY_MMAP) return EINVAL;
  const std::lock_guard lock(mutex_);
  if (request == VIDIOC_QBUF) {
    buffers_[buffer.index].is_queued = true;
    buffers_[buffer.index].is_filled = false;
  }
  describe(buffer.index, buffer);
  return 0;
}

int UserSpaceCard::dequeue(v4l2_buffer& out) {
  char byte = 0;
  const ssize_t got = ::read(file_, &byte, 1);
  if (got != 1) return got < 0 ? errno : EAGAIN;
  const std::lock_guard lock(mutex_);
  std::uint32_t oldest = kMaxBuffers;
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) {
    if (buffers_[i].is_filled &&
        (oldest == kMaxBuffers || buffers_[i].sequence < buffers_[oldest].sequence)) {
      oldest = i;
    }
  }
  if (oldest == kMaxBuffers) return EAGAIN;
  buffers_[oldest].is_filled = false;
  describe(oldest, out);
  last_stamp_ns_ = buffers_[oldest].stamp_ns;
  return 0;
}

int UserSpaceCard::stream(bool on) {
  if (!on) {
    stop();
  } else if (!is_streaming_) {
    is_streaming_ = true;
    feeder_ = std::thread([this] { feed(); });
  }
  return 0;
}

void UserSpaceCard::stop() {
  is_streaming_ = false;
  if (feeder_.joinable()) feeder_.join();
  for (Buffer& buffer : buffers_) buffer.is_queued = buffer.is_filled = false;
}

void UserSpaceCard::feed() {
  const std::int64_t period_ns = 1'000'000'000 / rate_hz_;
  std::int64_t due_ns = clock_ns(CLOCK_MONOTONIC) + period_ns;
  for (std::uint32_t sequence = 0; is_streaming_; ++sequence, due_ns += period_ns) {
    const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
    const std::lock_guard lock(mutex_);
    for (Buffer& buffer : buffers_) {
      if (buffer.is_queued) {
        const auto& picture = pictures_[sequence % pictures_.size()];
        std::memcpy(buffer.memory.data(), picture.data(), picture.size());
        buffer.used = static_cast<std::uint32_t>(picture.size());
        buffer.sequence = sequence;
        buffer.stamp_ns = clock_ns(CLOCK_MONOTONIC);
        buffer.is_queued = false;
        buffer.is_filled = true;
        [[maybe_unused]] const ssize_t rung = ::write(bell_, "p", 1);
        break;
      }
    }
    feeding_ns_ = clock_ns(CLOCK_THREAD_CPUTIME_ID);
  }
}

}  // namespace tubed
