// Pictures for a person to look at, as PNG files.
#pragma once

#include <cstdint>
#include <filesystem>

#include "drivers/png/png_file.hpp"

namespace cv {
class Mat;
}

namespace tubed {

/// Both throw std::runtime_error, with the file's name and what to do, when the file cannot be written.
void write_picture(const std::filesystem::path& file, const PictureBytes<const std::uint8_t>& picture);
/// `picture`: 8 bit, blue, green and red, as OpenCV draws.
void write_picture(const std::filesystem::path& file, const cv::Mat& picture);

}  // namespace tubed
