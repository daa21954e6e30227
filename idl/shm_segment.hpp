// The memory behind a ring: made once, sealed, handed out as a descriptor that can only be read.
#pragma once

#include <cstddef>
#include <string>

#include "idl/shm_layout.hpp"

namespace tubed {

/// A memfd and its mapping. Move-only.
class ShmSegment {
 public:
  /// Zeroed, writable here, and sealed: nobody, not even this process, can resize it, map it writable once
  /// more, or write it through a descriptor. All pages are there already. A child of fork() does not get the
  /// mapping. Throws ShmError.
  static ShmSegment create(const std::string& name, std::size_t bytes);
  /// Maps what a writer handed out, read-only; takes the descriptor over, also when it throws. Throws
  /// ShmError unless it is sealed so that it can neither shrink nor lack pages: reading it can never fail
  /// with SIGBUS.
  static ShmSegment adopt(int descriptor);

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

  int descriptor_ = -1;
  std::byte* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace tubed
