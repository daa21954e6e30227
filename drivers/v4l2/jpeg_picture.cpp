#include "drivers/v4l2/jpeg_picture.hpp"

#include <jerror.h>

#include <stdexcept>

namespace tubed {

namespace {

// libjpeg-turbo 2.1 takes 20 kB that last, and 330 kB for a picture of 8192 pixels in a row.
constexpr std::size_t kLastingBytes = std::size_t{1} << 18U;
constexpr std::size_t kPictureBytes = std::size_t{1} << 22U;

}  // namespace

// Errors leave libjpeg by longjmp: between setjmp and what may fail stands nothing that would have to be
// destroyed.
JpegPicture::JpegPicture() : memory_(kLastingBytes, kPictureBytes) {
  decoder_.err = jpeg_std_error(&errors_);
  errors_.error_exit = &leave;
  errors_.emit_message = &note;
  if (setjmp(errors_.back) != 0) {
    throw std::runtime_error("libjpeg is of another version than the one that this was built with");
  }
  jpeg_create_decompress(&decoder_);
  memory_.serve(decoder_);
}

JpegPicture::~JpegPicture() { jpeg_destroy_decompress(&decoder_); }

void JpegPicture::leave(j_common_ptr decoder) { std::longjmp(static_cast<Errors*>(decoder->err)->back, 1); }

// Levels below 0 are warnings: bytes are damaged or missing. Padding between two markers is not.
void JpegPicture::note(j_common_ptr decoder, int level) {
  if (level < 0 && decoder->err->msg_code != JWRN_EXTRANEOUS_DATA) {
    static_cast<Errors*>(decoder->err)->is_damaged = true;
  }
}

bool JpegPicture::fail(std::string_view why) noexcept {
  why_ = why;
  jpeg_abort_decompress(&decoder_);
  return false;
}

bool JpegPicture::begin(std::span<const std::uint8_t> bytes) noexcept {
  errors_.is_damaged = false;
  if (bytes.empty()) {
    return fail("it has no bytes");
  }
  if (setjmp(errors_.back) != 0) {
    return fail("it is no JPEG picture, or a damaged one");
  }
  jpeg_mem_src(&decoder_, bytes.data(), static_cast<unsigned long>(bytes.size()));
  jpeg_read_header(&decoder_, TRUE);
  // Its virtual arrays would allocate, and no grabber sends it.
  if (jpeg_has_multiple_scans(&decoder_) != FALSE) {
    return fail("it is JPEG of several scans (progressive); only baseline is read");
  }
  decoder_.out_color_space = JCS_GRAYSCALE;
  jpeg_start_decompress(&decoder_);
  return errors_.is_damaged ? fail("it is a damaged JPEG picture") : true;
}

PictureSize JpegPicture::size() const noexcept {
  return {static_cast<int>(decoder_.output_width), static_cast<int>(decoder_.output_height)};
}

bool JpegPicture::read_row(std::span<std::uint8_t> grey) noexcept {
  if (grey.size() < decoder_.output_width || decoder_.output_scanline >= decoder_.output_height) {
    return fail("it has fewer rows than its header says");
  }
  if (setjmp(errors_.back) != 0) {
    return fail("it is a damaged JPEG picture");
  }
  JSAMPROW row = grey.data();
  jpeg_read_scanlines(&decoder_, &row, 1);
  return errors_.is_damaged ? fail("it is a damaged JPEG picture: cable, bandwidth or the card's firmware")
                            : true;
}

void JpegPicture::end() noexcept { jpeg_abort_decompress(&decoder_); }

}  // namespace tubed
