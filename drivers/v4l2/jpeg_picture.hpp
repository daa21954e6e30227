// One picture of Motion JPEG to rows of grey values, by libjpeg-turbo.
#pragma once

#include <csetjmp>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/v4l2/jpeg_memory.hpp"
#include "drivers/v4l2/picture_shape.hpp"

namespace tubed {

/// Decodes pictures of JPEG's baseline; the standard's Huffman tables are taken where a picture brings none,
/// as Motion JPEG may. Whatever the bytes are: words, never an end of the program. One thread; nothing but
/// the constructor allocates.
class JpegPicture {
 public:
  JpegPicture();
  ~JpegPicture();
  JpegPicture(const JpegPicture&) = delete;
  JpegPicture& operator=(const JpegPicture&) = delete;

  /// Reads the header of the picture in `bytes`, which stay until its last row was read. False: why() says
  /// what is wrong; nothing of it is to be read then.
  bool begin(std::span<const std::uint8_t> bytes) noexcept;
  /// Precondition: begin() succeeded.
  [[nodiscard]] PictureSize size() const noexcept;
  /// The next row, luma of size().width pixels. False: why() says what is wrong; the picture is over then. A
  /// damaged row is no row: what the decoder would fill in is invented.
  bool read_row(std::span<std::uint8_t> grey) noexcept;
  /// The rows left are not read; harmless when there are none.
  void end() noexcept;
  /// Constant text, for a message that begins "a picture was refused: ".
  [[nodiscard]] std::string_view why() const noexcept { return why_; }

 private:
  struct Errors : jpeg_error_mgr {
    std::jmp_buf back;
    bool is_damaged = false;
  };

  [[noreturn]] static void leave(j_common_ptr decoder);
  static void note(j_common_ptr decoder, int level);
  bool fail(std::string_view why) noexcept;

  JpegMemory memory_;
  Errors errors_{};
  jpeg_decompress_struct decoder_{};
  std::string_view why_;
};

}  // namespace tubed
