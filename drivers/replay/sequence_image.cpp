#include "drivers/replay/sequence_image.hpp"

#include <string>

#include "drivers/png/png_file.hpp"

namespace tubed {

namespace {

constexpr PixelLayout layout_of(PixelDepth depth) {
  return depth == PixelDepth::kGrey16 ? PixelLayout::kGrey16 : PixelLayout::kGrey8;
}

void check_header(const PngHeader& header, const CameraCalibration& camera, const SequenceFrame& frame) {
  if (header.layout != PixelLayout::kGrey8 && header.layout != PixelLayout::kGrey16) {
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

}  // namespace

GreyImage read_image(const Sequence& sequence, const SequenceFrame& frame) {
  const std::filesystem::path file = sequence.folder / frame.file;
  const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
  try {
    const PngHeader header = read_png_header(file);
    check_header(header, camera, frame);
    const PixelLayout layout = *header.layout;
    GreyImage image{
        camera.width, camera.height,
        layout == PixelLayout::kGrey16 ? PixelDepth::kGrey16 : PixelDepth::kGrey8,
        std::vector<std::uint8_t>(static_cast<std::size_t>(camera.width) *
                                  static_cast<std::size_t>(camera.height) * bytes_per_pixel(layout))};
    read_png(file, {image.width, image.height, layout, image.pixels});
    return image;
  } catch (const PngError& error) {
    throw SequenceError(frame.position, "the image " + in_quotes(frame.file.string()) + " " + error.what());
  }
}

std::vector<std::uint8_t> encode_image(const GreyImage& image) {
  // X-ray noise hardly compresses.
  return encode_png({image.width, image.height, layout_of(image.depth), image.pixels}, PngCompression::kFast);
}

void write_image(const std::filesystem::path& file, const GreyImage& image) {
  try {
    write_png(file, {image.width, image.height, layout_of(image.depth), image.pixels}, PngCompression::kFast);
  } catch (const PngError& error) {
    throw SequenceError({file}, std::string("the image ") + error.what());
  }
}

}  // namespace tubed
