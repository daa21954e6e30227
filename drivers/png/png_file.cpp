#include "drivers/png/png_file.hpp"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <memory>

namespace tubed {

namespace {

constexpr std::array<unsigned char, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

/// The signature and the IHDR chunk up to its colour type (PNG specification, section 11.2.2).
using FirstBytes = std::array<unsigned char, 26>;

std::int64_t big_endian(const FirstBytes& bytes, std::size_t at) {
  return (std::int64_t{bytes[at]} << 24) | (std::int64_t{bytes[at + 1]} << 16) |
         (std::int64_t{bytes[at + 2]} << 8) | std::int64_t{bytes[at + 3]};
}

std::optional<PixelLayout> layout_of(int bit_depth, int colour_type) {
  if (colour_type == PNG_COLOR_TYPE_GRAY && bit_depth == 8) {
    return PixelLayout::kGrey8;
  }
  if (colour_type == PNG_COLOR_TYPE_GRAY && bit_depth == 16) {
    return PixelLayout::kGrey16;
  }
  if (colour_type == PNG_COLOR_TYPE_RGB && bit_depth == 8) {
    return PixelLayout::kRgb8;
  }
  return {};
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

void say_nothing(png_structp /*png*/, png_const_charp /*warning*/) {}

/// libpng reports an error by a jump back to setjmp(): between the two there is nothing to destroy.
void jump_back(png_structp png, png_const_charp /*error*/) { png_longjmp(png, 1); }

void swap_16_bits(png_structp png, PixelLayout layout) {
  if (layout == PixelLayout::kGrey16 && std::endian::native == std::endian::little) {
    png_set_swap(png);  // a PNG is big-endian
  }
}

bool decode_rows(png_structp png, png_infop header, std::FILE* file,
                 const PictureBytes<std::uint8_t>& picture) {
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_init_io(png, file);
  png_read_info(png, header);
  swap_16_bits(png, picture.layout);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, header);
  const auto height = static_cast<std::size_t>(picture.height);
  const std::size_t row_bytes = png_get_rowbytes(png, header);
  if (layout_of(png_get_bit_depth(png, header), png_get_color_type(png, header)) != picture.layout ||
      png_get_image_height(png, header) != height || row_bytes * height != picture.pixels.size()) {
    return false;  // not what the caller was told by read_png_header()
  }
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t row = 0; row < height; ++row) {
      png_read_row(png, picture.pixels.data() + row * row_bytes, nullptr);
    }
  }
  png_read_end(png, nullptr);
  return true;
}

void choose_compression(png_structp png, PngCompression compression) {
  if (compression == PngCompression::kFast) {
    png_set_compression_level(png, 1);
    png_set_compression_strategy(png, Z_RLE);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  } else {
    png_set_compression_level(png, 9);
  }
}

/// Of libpng: `bytes` of the picture follow. Nothing may be thrown through C.
void append_bytes(png_structp png, png_bytep bytes, png_size_t count) {
  auto& encoded = *static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  bool has_room = true;
  try {
    encoded.insert(encoded.end(), bytes, bytes + count);
  } catch (const std::bad_alloc&) {
    has_room = false;
  }
  if (!has_room) png_error(png, "no memory");
}

bool encode_rows(png_structp png, png_infop header, std::vector<std::uint8_t>& encoded,
                 const PictureBytes<const std::uint8_t>& picture, PngCompression compression) {
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_set_write_fn(png, &encoded, append_bytes, nullptr);
  choose_compression(png, compression);
  png_set_IHDR(png, header, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height),
               picture.layout == PixelLayout::kGrey16 ? 16 : 8,
               picture.layout == PixelLayout::kRgb8 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, header);
  swap_16_bits(png, picture.layout);
  const std::size_t row_bytes = static_cast<std::size_t>(picture.width) * bytes_per_pixel(picture.layout);
  for (std::size_t row = 0; row < static_cast<std::size_t>(picture.height); ++row) {
    png_write_row(png, picture.pixels.data() + row * row_bytes);
  }
  png_write_end(png, nullptr);
  return true;
}

}  // namespace

PngHeader read_png_header(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw PngError("is missing or cannot be read");
  }
  FirstBytes bytes{};
  stream.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  if (!stream || !std::equal(kPngSignature.begin(), kPngSignature.end(), bytes.begin())) {
    throw PngError("is not a PNG; convert it to one");
  }
  return {big_endian(bytes, 16), big_endian(bytes, 20), layout_of(bytes[24], bytes[25])};
}

void read_png(const std::filesystem::path& file, const PictureBytes<std::uint8_t>& picture) {
  const File opened(std::fopen(file.c_str(), "rb"));
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, jump_back, say_nothing);
  png_infop header = png == nullptr ? nullptr : png_create_info_struct(png);
  const bool decoded =
      opened != nullptr && header != nullptr && decode_rows(png, header, opened.get(), picture);
  png_destroy_read_struct(&png, &header, nullptr);
  if (!decoded) {
    throw PngError("cannot be decoded; is it damaged or cut off?");
  }
}

std::vector<std::uint8_t> encode_png(const PictureBytes<const std::uint8_t>& picture,
                                     PngCompression compression) {
  std::vector<std::uint8_t> encoded;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, jump_back, say_nothing);
  png_infop header = png == nullptr ? nullptr : png_create_info_struct(png);
  const bool is_encoded = header != nullptr && encode_rows(png, header, encoded, picture, compression);
  png_destroy_write_struct(&png, &header);
  if (!is_encoded) {
    throw PngError("cannot be encoded: memory is short");
  }
  return encoded;
}

void write_png(const std::filesystem::path& file, const PictureBytes<const std::uint8_t>& picture,
               PngCompression compression) {
  const std::vector<std::uint8_t> encoded = encode_png(picture, compression);
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(encoded.data()), static_cast<std::streamsize>(encoded.size()));
  // A full disk may be noticed as late as on closing.
  stream.close();
  if (!stream) {
    throw PngError("cannot be written; check the folder, its permissions and free space");
  }
}

}  // namespace tubed
