#include "clients/tubectl/see/picture_file.hpp"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace tubed {

void write_picture(const std::filesystem::path& file, const PictureBytes<const std::uint8_t>& picture) {
  try {
    write_png(file, picture, PngCompression::kSmall);
  } catch (const PngError& error) {
    throw std::runtime_error(file.string() + " " + error.what());
  }
}

void write_picture(const std::filesystem::path& file, const cv::Mat& picture) {
  cv::Mat rgb;  // without padding: a matrix that OpenCV makes is continuous
  cv::cvtColor(picture, rgb, cv::COLOR_BGR2RGB);
  write_picture(file, {rgb.cols, rgb.rows, PixelLayout::kRgb8, {rgb.data, rgb.total() * rgb.elemSize()}});
}

}  // namespace tubed
