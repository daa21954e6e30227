// A capture card in user space: what user_space_calls.cpp puts in the place of a device. Not a test of the
// kernel's side.
#pragma once

#include <dlfcn.h>
#include <linux/videodev2.h>
#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace tubed {

/// The function of that name in the C library, behind the one that is loaded in front of it.
template <typename Function>
Function next_of(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

/// One card, opened once at a time; its file is the far end of a terminal, whose bytes are pictures that are
/// ready. Calls come from the program's threads, pictures from one of its own.
class UserSpaceCard {
 public:
  /// "PATH,WIDTH,HEIGHT,FOURCC,RATE_HZ,PICTURES": see user_space_calls.cpp.
  explicit UserSpaceCard(const std::string& words);
  ~UserSpaceCard() { stop(); }
  UserSpaceCard(const UserSpaceCard&) = delete;
  UserSpaceCard& operator=(const UserSpaceCard&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool is_original(int file) const { return file >= 0 && file == file_; }
  /// Also a duplicate of the descriptor: the terminal is the same.
  [[nodiscard]] bool is(int file) const;
  /// Of the picture that was handed out last, CLOCK_MONOTONIC.
  [[nodiscard]] std::int64_t last_stamp_ns() const { return last_stamp_ns_.load(); }
  /// CPU time that handing out has taken so far.
  [[nodiscard]] std::int64_t feeding_ns() const { return feeding_ns_.load(); }

  int open(int flags);
  void close();
  void* map(std::int64_t offset);
  [[nodiscard]] bool owns(const void* memory) const;
  /// ioctl(2) of Video4Linux: 0 or errno.
  int control(unsigned long request, void* argument);

 private:
  struct Buffer {
    std::vector<std::uint8_t> memory;
    bool is_queued = false;
    bool is_filled = false;
    std::uint32_t used = 0;
    std::uint32_t sequence = 0;
    std::int64_t stamp_ns = 0;
  };

  [[nodiscard]] std::uint32_t pixel_format() const;
  int describe_capability(v4l2_capability& out) const;
  int describe_format(v4l2_format& out) const;
  int describe_rate(v4l2_streamparm& out) const;
  static int describe_input(v4l2_input& out);
  int enumerate(unsigned long request, void* argument) const;
  void describe(std::uint32_t number, v4l2_buffer& out) const;
  int request_buffers(v4l2_requestbuffers& wanted);
  int queue(unsigned long request, v4l2_buffer& buffer);
  int dequeue(v4l2_buffer& out);
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

}  // namespace tubed
