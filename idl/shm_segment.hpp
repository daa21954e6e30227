// The memory behind a ring: made once, sealed, handed out as a descriptor that can only be read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "idl/shm_layout.hpp"

namespace tubed {

/// A memfd and its mapping. Move-only.
class ShmSegment {
 public:
  /// Zeroed, writable here, and sealed: nobody, not even this process, can resize it, map it writable once
  /// more, or write it through a descriptor. All pages are there and in this process's tables already: a
  /// real-time thread that writes waits for none. A child of fork() does not get the mapping. Throws
  /// ShmError.
  static ShmSegment create(const std::string& name, std::size_t bytes);
  /// Maps what a writer handed out, read-only, as far as its header says; takes the descriptor over, also
  /// when it throws. Before anything is mapped: it is sealed so that it can neither shrink nor lose pages,
  /// has at most `max_bytes`, no hole (a hole that is read is filled with pages of the reader's), and a
  /// header that fits it. Then reading it can neither fail with SIGBUS nor cost memory; its pages are in this
  /// process's tables already. Throws ShmError.
  static ShmSegment adopt(int descriptor, std::uint64_t max_bytes = kShmMaxSegmentBytes);

  ~ShmSegment();
  ShmSegment(ShmSegment&& other) noexcept;
  ShmSegment& operator=(ShmSegment&& other) noexcept;

  /// Writable after create(); after adopt() writing is a SIGSEGV.
  [[nodiscard]] std::byte* memory() const { return memory_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  explicit ShmSegment(int descriptor) : descriptor_(descriptor) {}
  void map(int protection);
  void touch_pages() const;

  int descriptor_ = -1;
  std::byte* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace tubed
