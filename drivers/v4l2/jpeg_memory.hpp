// Memory for libjpeg that is taken once.
#pragma once

#include <cstddef>
#include <cstdio>  // jpeglib.h lacks it
#include <vector>

#include <jpeglib.h>

namespace tubed {

/// libjpeg takes memory anew for each picture. This hands it pieces of two blocks instead: one for what
/// outlives a picture (tables), one that is empty again after each. One thread; whoever takes more than there
/// is gets libjpeg's error. Pictures decoded in one scan only: the virtual arrays of others are libjpeg's
/// own.
class JpegMemory {
 public:
  JpegMemory(std::size_t lasting_bytes, std::size_t picture_bytes);
  JpegMemory(const JpegMemory&) = delete;
  JpegMemory& operator=(const JpegMemory&) = delete;

  /// From now on `decoder`, which has been created, takes memory here. This object outlives it, at its place;
  /// decoder.client_data is taken.
  void serve(jpeg_decompress_struct& decoder) noexcept;

 private:
  struct Block {
    std::vector<std::max_align_t> room;
    std::size_t used = 0;  ///< bytes

    void* take(std::size_t bytes) noexcept;
  };

  static JpegMemory& of(j_common_ptr decoder) noexcept;
  static void* take(j_common_ptr decoder, int pool, std::size_t bytes);
  template <typename Row>
  static Row* take_rows(j_common_ptr decoder, int pool, std::size_t row_bytes, JDIMENSION count);
  static void empty(j_common_ptr decoder, int pool);

  Block lasting_;
  Block picture_;
};

}  // namespace tubed
