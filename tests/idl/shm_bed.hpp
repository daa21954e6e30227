// What the tests of the shared memory share: a folder, the time, a writer of small samples.
#pragma once

#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "idl/shm_reader.hpp"
#include "idl/shm_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {

inline std::int64_t shm_test_now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

/// A folder that everybody may enter, removed at the end.
class ShmFolder {
 public:
  ShmFolder() { chmod(path_.c_str(), 0755); }
  [[nodiscard]] std::string socket() const { return path_ + "/ring.sock"; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::string path_ = folder_.path().string();
};

inline ShmWriterSettings small_writer(const std::string& socket, std::uint32_t slots = 4,
                                      std::uint64_t payload_bytes = 256) {
  return {.door = {.path = socket, .group = {}},
          .geometry = {slots, payload_bytes},
          .identity = {TUBED_SHM_IMAGES, TUBED_SHM_IMAGES_VERSION, "A", 0}};
}

inline ShmReaderSettings small_reader(const std::string& socket, int timeout_ms = 5000) {
  return {.path = socket,
          .content = TUBED_SHM_IMAGES,
          .content_version = TUBED_SHM_IMAGES_VERSION,
          .timeout_ms = timeout_ms,
          .trusted = {}};
}

/// Words of sample `number`: every one differs from every word of every other sample.
inline std::uint64_t pattern_word(std::uint64_t number, std::size_t place) {
  return (number * 0x9e3779b97f4a7c15ULL) ^ (place * 0xc2b2ae3d27d4eb4fULL);
}

inline void fill_pattern(std::span<std::uint64_t> words, std::uint64_t number) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i] = pattern_word(number, i);
  }
}

inline bool is_pattern(std::span<const std::uint64_t> words, std::uint64_t number) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] != pattern_word(number, i)) {
      return false;
    }
  }
  return true;
}

}  // namespace tubed
