#include "drivers/replay/sequence_image.hpp"

#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

namespace tubed {

namespace {

constexpr std::array<unsigned char, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr int kGreyColourType = 0;

/// What the IHDR chunk at the start of every PNG says (PNG specification, section 11.2.2).
struct PngHeader {
  std::int64_t width = 0;
  std::int64_t height = 0;
  int bit_depth = 0;
  int colour_type = 0;
};

std::int64_t big_endian(const std::array<unsigned char, 26>& bytes, std::size_t at) {
  return (std::int64_t{bytes[at]} << 24) | (std::int64_t{bytes[at + 1]} << 16) |
         (std::int64_t{bytes[at + 2]} << 8) | std::int64_t{bytes[at + 3]};
}

PngHeader read_header(const std::filesystem::path& file, const SequenceFrame& frame) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw SequenceError(frame.position,
                        "the image '" + frame.file.string() + "' is missing or cannot be read");
  }
  std::array<unsigned char, 26> bytes{};
  stream.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  if (!stream || !std::equal(kPngSignature.begin(), kPngSignature.end(), bytes.begin())) {
    throw SequenceError(frame.position, in_quotes(frame.file.string()) +
                                            " is not a PNG; convert it to 8- or 16-bit grey PNG");
  }
  return {big_endian(bytes, 16), big_endian(bytes, 20), bytes[24], bytes[25]};
}

void check_header(const PngHeader& header, const CameraCalibration& camera, const SequenceFrame& frame) {
  if (header.colour_type != kGreyColourType || (header.bit_depth != 8 && header.bit_depth != 16)) {
    throw SequenceError(frame.position,
                        in_quotes(frame.file.string()) + " is not 8- or 16-bit grey; convert it to grey");
  }
  if (header.width != camera.width || header.height != camera.height) {
    throw SequenceError(frame.position,
                        in_quotes(frame.file.string()) + " has " + std::to_string(header.width) + " x " +
                            std::to_string(header.height) + " pixels, camera '" + camera.name + "' " +
                            std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                            "; correct sequence.toml or the image");
  }
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

constexpr std::size_t bytes_of_row(std::size_t width, PixelDepth depth) {
  return width * (depth == PixelDepth::kGrey16 ? 2 : 1);
}

void say_nothing(png_structp /*png*/, png_const_charp /*warning*/) {}

/// libpng reports an error by a jump back to setjmp(): between the two there is nothing to destroy.
void jump_back(png_structp png, png_const_charp /*error*/) { png_longjmp(png, 1); }

void swap_16_bits(png_structp png, PixelDepth depth) {
  if (depth == PixelDepth::kGrey16 && std::endian::native == std::endian::little) {
    png_set_swap(png);  // a PNG is big-endian
  }
}

bool decode_rows(png_structp png, png_infop header, std::FILE* file, GreyImage& image) {
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_init_io(png, file);
  png_read_info(png, header);
  swap_16_bits(png, image.depth);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, header);
  const auto height = static_cast<std::size_t>(image.height);
  const std::size_t row_bytes = png_get_rowbytes(png, header);
  if (png_get_image_height(png, header) != height || row_bytes * height != image.pixels.size()) {
    return false;  // a second header that contradicts the first
  }
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t row = 0; row < height; ++row) {
      png_read_row(png, image.pixels.data() + row * row_bytes, nullptr);
    }
  }
  png_read_end(png, nullptr);
  return true;
}

/// Fills the pixels of an image whose size and depth are set; false when the file is damaged.
bool decode(const std::filesystem::path& path, GreyImage& image) {
  const File file(std::fopen(path.c_str(), "rb"));
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, jump_back, say_nothing);
  png_infop header = png == nullptr ? nullptr : png_create_info_struct(png);
  const bool decoded = file != nullptr && header != nullptr && decode_rows(png, header, file.get(), image);
  png_destroy_read_struct(&png, &header, nullptr);
  return decoded;
}

bool encode_rows(png_structp png, png_infop header, std::FILE* file, const GreyImage& image) {
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_init_io(png, file);
  // X-ray noise hardly compresses: what costs least time costs little more space.
  png_set_compression_level(png, 1);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(png, header, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height),
               image.depth == PixelDepth::kGrey16 ? 16 : 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, header);
  swap_16_bits(png, image.depth);
  const std::size_t row_bytes = bytes_of_row(static_cast<std::size_t>(image.width), image.depth);
  for (std::size_t row = 0; row < static_cast<std::size_t>(image.height); ++row) {
    png_write_row(png, image.pixels.data() + row * row_bytes);
  }
  png_write_end(png, nullptr);
  return true;
}

bool encode(const std::filesystem::path& path, const GreyImage& image) {
  File file(std::fopen(path.c_str(), "wb"));
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, jump_back, say_nothing);
  png_infop header = png == nullptr ? nullptr : png_create_info_struct(png);
  const bool encoded = file != nullptr && header != nullptr && encode_rows(png, header, file.get(), image);
  png_destroy_write_struct(&png, &header);
  return encoded && std::fclose(file.release()) == 0;  // a full disk may be noticed as late as that
}

}  // namespace

GreyImage read_image(const Sequence& sequence, const SequenceFrame& frame) {
  const std::filesystem::path file = sequence.folder / frame.file;
  const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
  const PngHeader header = read_header(file, frame);
  check_header(header, camera, frame);
  const PixelDepth depth = header.bit_depth == 16 ? PixelDepth::kGrey16 : PixelDepth::kGrey8;

  const std::size_t bytes =
      bytes_of_row(static_cast<std::size_t>(camera.width), depth) * static_cast<std::size_t>(camera.height);
  GreyImage image{camera.width, camera.height, depth, std::vector<std::uint8_t>(bytes)};
  if (!decode(file, image)) {
    throw SequenceError(frame.position,
                        in_quotes(frame.file.string()) + " cannot be decoded; is it damaged or cut off?");
  }
  return image;
}

void write_image(const std::filesystem::path& file, const GreyImage& image) {
  if (!encode(file, image)) {
    throw SequenceError({file}, "the image cannot be written; check the folder's permissions and free space");
  }
}

}  // namespace tubed
