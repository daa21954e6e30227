// A capture card in user space: preloaded into a program (LD_PRELOAD), it is what the program finds at the
// path in TUBED_CARD. For machines without a card: system calls of opening, controls, buffers and waiting are
// those of a program at a real one, and what happens behind them is memory. Not a test of the kernel's side.
//
// TUBED_CARD = PATH,WIDTH,HEIGHT,FOURCC,RATE_HZ,PICTURES: pictures from that file, each as its length (32
// bits of this machine) and its bytes, over and over.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr std::uint32_t kMaxBuffers = 16;
constexpr std::uint32_t kOffsetStep = 1U << 26U;

template <typename Function>
Function next_of(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

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

struct Buffer {
  std::vector<std::uint8_t> memory;
  bool is_queued = false;
  bool is_filled = false;
  std::uint32_t used = 0;
  std::uint32_t sequence = 0;
  std::int64_t stamp_ns = 0;
};

/// One card, opened once at a time; its file is the far end of a terminal, whose bytes are pictures that are
/// ready.
class Card {
 public:
  explicit Card(const std::string& words) {
    std::istringstream text(words);
    std::string width, height, rate, pictures;
    std::getline(text, path_, ',');
    std::getline(text, width, ',');
    std::getline(text, height, ',');
    std::getline(text, fourcc_, ',');
    std::getline(text, rate, ',');
    std::getline(text, pictures, ',');
    width_ = static_cast<std::uint32_t>(std::atoi(width.c_str()));
    height_ = static_cast<std::uint32_t>(std::atoi(height.c_str()));
    rate_hz_ = static_cast<std::uint32_t>(std::atoi(rate.c_str()));
    pictures_ = read_pictures(pictures);
    for (const auto& picture : pictures_) {
      size_ = std::max(size_, static_cast<std::uint32_t>(picture.size()));
    }
    fourcc_.resize(4, ' ');
  }
  ~Card() { stop(); }

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool is_original(int file) const { return file >= 0 && file == file_; }
  /// Also a duplicate of the descriptor: the terminal is the same.
  [[nodiscard]] bool is(int file) const {
    struct stat other {};
    return file_ >= 0 && (file == file_ || (::fstat(file, &other) == 0 && S_ISCHR(other.st_mode) &&
                                            other.st_rdev == terminal_));
  }
  [[nodiscard]] std::int64_t last_stamp_ns() const { return last_stamp_ns_.load(); }
  [[nodiscard]] std::int64_t feeding_ns() const { return feeding_ns_.load(); }

  int open(int flags) {
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
  void close() {
    stop();
    next_of<int (*)(int)>("close")(bell_);
    bell_ = file_ = -1;
  }
  void* map(std::int64_t offset) {
    const auto number = static_cast<std::uint32_t>(offset / kOffsetStep);
    return number < buffers_.size() ? static_cast<void*>(buffers_[number].memory.data()) : MAP_FAILED;
  }
  [[nodiscard]] bool owns(const void* memory) const {
    for (const Buffer& buffer : buffers_) {
      if (buffer.memory.data() == memory) return true;
    }
    return false;
  }

  /// 0 or errno.
  int control(unsigned long request, void* argument);

 private:
  [[nodiscard]] std::uint32_t pixel_format() const {
    return v4l2_fourcc(static_cast<std::uint32_t>(fourcc_[0]), static_cast<std::uint32_t>(fourcc_[1]),
                       static_cast<std::uint32_t>(fourcc_[2]), static_cast<std::uint32_t>(fourcc_[3]));
  }
  void write_format(v4l2_format& format) const {
    v4l2_pix_format& pix = format.fmt.pix;
    pix = {};
    pix.width = width_;
    pix.height = height_;
    pix.pixelformat = pixel_format();
    pix.field = V4L2_FIELD_NONE;
    pix.bytesperline = fourcc_ == "MJPG" ? 0 : size_ / height_;
    pix.sizeimage = size_;
    pix.colorspace = fourcc_ == "MJPG" ? V4L2_COLORSPACE_JPEG : V4L2_COLORSPACE_RAW;
  }
  void describe(std::uint32_t number, v4l2_buffer& out) const;
  int dequeue(v4l2_buffer& out);
  int describe_capability(v4l2_capability& out) const;
  int enumerate(unsigned long request, void* argument) const;
  int stream(bool on);
  void stop();
  void feed();

  std::string path_, fourcc_;
  std::uint32_t width_ = 0, height_ = 0, rate_hz_ = 0, size_ = 0;
  std::vector<std::vector<std::uint8_t>> pictures_;
  std::vector<Buffer> buffers_;
  std::mutex mutex_;
  std::thread feeder_;
  std::atomic<bool> is_streaming_ = false;
  std::atomic<std::int64_t> last_stamp_ns_ = 0;
  std::atomic<std::int64_t> feeding_ns_ = 0;
  dev_t terminal_ = 0;
  int bell_ = -1, file_ = -1;
};

void Card::describe(std::uint32_t number, v4l2_buffer& out) const {
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

int Card::describe_capability(v4l2_capability& out) const {
  out = {};
  std::strcpy(reinterpret_cast<char*>(out.driver), "tubed_card");
  std::strcpy(reinterpret_cast<char*>(out.card), "a card in user space");
  std::strcpy(reinterpret_cast<char*>(out.bus_info), "platform:user");
  out.version = 0x060100;
  out.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  out.capabilities = out.device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

int Card::enumerate(unsigned long request, void* argument) const {
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

int Card::control(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      return describe_capability(*static_cast<v4l2_capability*>(argument));
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumerate(request, argument);
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT: {
      auto& format = *static_cast<v4l2_format*>(argument);
      if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
      write_format(format);
      return 0;
    }
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM: {
      auto& parameters = *static_cast<v4l2_streamparm*>(argument);
      parameters.parm.capture = {};
      parameters.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
      parameters.parm.capture.timeperframe = {1, rate_hz_};
      return 0;
    }
    case VIDIOC_ENUMINPUT: {
      auto& input = *static_cast<v4l2_input*>(argument);
      if (input.index > 0) return EINVAL;
      input = {};
      input.type = V4L2_INPUT_TYPE_CAMERA;
      std::strcpy(reinterpret_cast<char*>(input.name), "input");
      return 0;
    }
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_S_INPUT:
      return 0;
    case VIDIOC_REQBUFS: {
      auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
      if (wanted.memory != V4L2_MEMORY_MMAP) return EINVAL;
      stop();
      wanted.count = std::min(wanted.count, kMaxBuffers);
      wanted.capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP;
      buffers_.assign(wanted.count, Buffer{});
      for (Buffer& buffer : buffers_) buffer.memory.resize(size_);
      return 0;
    }
    case VIDIOC_QUERYBUF:
    case VIDIOC_QBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= buffers_.size() || buffer.memory != V4L2_MEMORY_MMAP) return EINVAL;
      const std::lock_guard lock(mutex_);
      if (request == VIDIOC_QBUF) {
        buffers_[buffer.index].is_queued = true;
        buffers_[buffer.index].is_filled = false;
      }
      describe(buffer.index, buffer);
      return 0;
    }
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

int Card::dequeue(v4l2_buffer& out) {
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

int Card::stream(bool on) {
  if (!on) {
    stop();
  } else if (!is_streaming_) {
    is_streaming_ = true;
    feeder_ = std::thread([this] { feed(); });
  }
  return 0;
}

void Card::stop() {
  is_streaming_ = false;
  if (feeder_.joinable()) feeder_.join();
  for (Buffer& buffer : buffers_) buffer.is_queued = buffer.is_filled = false;
}

void Card::feed() {
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

Card* card() {
  static Card* const only = [] {
    const char* const words = std::getenv("TUBED_CARD");
    return words == nullptr ? nullptr : new Card(words);
  }();
  return only;
}

bool is_card(const char* path) { return card() != nullptr && card()->path() == path; }

}  // namespace

extern "C" {

/// Stamp of the picture that was handed out last; time of a CPU that handing them out has taken so far.
std::int64_t tubed_card_last_stamp_ns() { return card() == nullptr ? 0 : card()->last_stamp_ns(); }
std::int64_t tubed_card_feeding_ns() { return card() == nullptr ? 0 : card()->feeding_ns(); }

int open(const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const auto mode = static_cast<mode_t>(va_arg(rest, int));
  va_end(rest);
  return is_card(path) ? card()->open(flags)
                       : next_of<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const auto mode = static_cast<mode_t>(va_arg(rest, int));
  va_end(rest);
  return is_card(path) ? card()->open(flags)
                       : next_of<int (*)(const char*, int, ...)>("open64")(path, flags, mode);
}

int __open_2(const char* path, int flags) { return open(path, flags); }
int __open64_2(const char* path, int flags) { return open64(path, flags); }

int stat(const char* path, struct stat* out) {
  return next_of<int (*)(const char*, struct stat*)>("stat")(is_card(path) ? "/dev/null" : path, out);
}

int stat64(const char* path, struct stat64* out) {
  return next_of<int (*)(const char*, struct stat64*)>("stat64")(is_card(path) ? "/dev/null" : path, out);
}

int close(int file) {
  if (card() != nullptr && card()->is_original(file)) card()->close();
  return next_of<int (*)(int)>("close")(file);
}

int ioctl(int file, unsigned long request, ...) {
  std::va_list rest;
  va_start(rest, request);
  void* const argument = va_arg(rest, void*);
  va_end(rest);
  if (card() == nullptr || !card()->is(file) || _IOC_TYPE(request) != 'V') {
    return next_of<int (*)(int, unsigned long, ...)>("ioctl")(file, request, argument);
  }
  const int error = card()->control(request & 0xFFFFFFFFUL, argument);
  errno = error == 0 ? errno : error;
  return error == 0 ? 0 : -1;
}

void* mmap(void* where, std::size_t bytes, int protection, int flags, int file, off_t offset) {
  if (file >= 0 && card() != nullptr && card()->is(file)) return card()->map(offset);
  return next_of<void* (*)(void*, std::size_t, int, int, int, off_t)>("mmap")(where, bytes, protection, flags,
                                                                              file, offset);
}

void* mmap64(void* where, std::size_t bytes, int protection, int flags, int file, off64_t offset) {
  if (file >= 0 && card() != nullptr && card()->is(file)) return card()->map(offset);
  return next_of<void* (*)(void*, std::size_t, int, int, int, off64_t)>("mmap64")(where, bytes, protection,
                                                                                  flags, file, offset);
}

int munmap(void* memory, std::size_t bytes) {
  if (card() != nullptr && card()->owns(memory)) return 0;
  return next_of<int (*)(void*, std::size_t)>("munmap")(memory, bytes);
}
}
