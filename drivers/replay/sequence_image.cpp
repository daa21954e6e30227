#include "drivers/replay/sequence_image.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
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

int opencv_type(PixelDepth depth) { return depth == PixelDepth::kGrey16 ? CV_16UC1 : CV_8UC1; }

}  // namespace

GreyImage read_image(const Sequence& sequence, const SequenceFrame& frame) {
  const std::filesystem::path file = sequence.folder / frame.file;
  const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
  const PngHeader header = read_header(file, frame);
  check_header(header, camera, frame);
  const PixelDepth depth = header.bit_depth == 16 ? PixelDepth::kGrey16 : PixelDepth::kGrey8;

  const cv::Mat decoded = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (decoded.type() != opencv_type(depth) || decoded.cols != camera.width || decoded.rows != camera.height ||
      !decoded.isContinuous()) {
    throw SequenceError(frame.position,
                        in_quotes(frame.file.string()) + " cannot be decoded; is it damaged or cut off?");
  }
  const std::size_t bytes = decoded.total() * decoded.elemSize();
  return {camera.width, camera.height, depth, {decoded.data, decoded.data + bytes}};
}

void write_image(const std::filesystem::path& file, const GreyImage& image) {
  // OpenCV has no view of constant pixels; imwrite only reads them.
  const cv::Mat view(image.height, image.width, opencv_type(image.depth),
                     const_cast<std::uint8_t*>(image.pixels.data()));
  bool written = false;
  try {
    written = cv::imwrite(file.string(), view);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written) {
    throw SequenceError({file}, "the image cannot be written; check the folder's permissions and free space");
  }
}

}  // namespace tubed
