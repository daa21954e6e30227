// Pictures as cards lay them in their buffers, and the same conversions by OpenCV, the second implementation.
#pragma once

#include <rapidcheck.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "drivers/v4l2/grey_converter.hpp"

namespace tubed {

/// A picture of noise with `padding` bytes behind each row, which are noise as well.
struct CardBuffer {
  CardPicture picture;
  std::vector<std::uint8_t> bytes;
};

inline CardBuffer noise_picture(PixelFormat format, PictureSize size, std::size_t padding, unsigned seed) {
  CardBuffer buffer{{format, size, 0}, {}};
  const auto& facts = facts_of(format);
  buffer.picture.stride = static_cast<std::size_t>(size.width) * facts.bytes_per_pixel + padding;
  const std::size_t planes_of_two = format == PixelFormat::kNv12 ? 3 : 2;
  buffer.bytes.resize(buffer.picture.stride * static_cast<std::size_t>(size.height) * planes_of_two / 2);
  std::uint32_t state = seed * 2654435761U + 1;
  for (auto& byte : buffer.bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(state >> 24U);
  }
  return buffer;
}

/// A picture that JPEG can keep: smooth, with some noise.
inline cv::Mat smooth_picture(PictureSize size, unsigned seed) {
  cv::Mat picture(size.height, size.width, CV_8UC3);
  cv::RNG random(seed);
  random.fill(picture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(picture, picture, {5, 5}, 2, 2, cv::BORDER_REFLECT);
  return picture;
}

inline CardBuffer jpeg_picture(const cv::Mat& picture, std::vector<int> options = {}) {
  CardBuffer buffer{{PixelFormat::kMjpg, {picture.cols, picture.rows}, 0}, {}};
  cv::imencode(".jpg", picture, buffer.bytes, options);
  return buffer;
}

/// The grey plane of the whole picture, by OpenCV.
inline cv::Mat grey_by_opencv(const CardBuffer& buffer) {
  auto* const data = const_cast<std::uint8_t*>(buffer.bytes.data());
  const auto [width, height] = buffer.picture.size;
  const auto view = [&](int type) { return cv::Mat(height, width, type, data, buffer.picture.stride); };
  cv::Mat grey;
  switch (buffer.picture.format) {
    case PixelFormat::kGrey:
    case PixelFormat::kNv12:
      return view(CV_8UC1).clone();
    case PixelFormat::kYuyv:
      cv::extractChannel(view(CV_8UC2), grey, 0);
      return grey;
    case PixelFormat::kUyvy:
      cv::extractChannel(view(CV_8UC2), grey, 1);
      return grey;
    case PixelFormat::kRgb24:
      cv::cvtColor(view(CV_8UC3), grey, cv::COLOR_RGB2GRAY);
      return grey;
    case PixelFormat::kBgr24:
      cv::cvtColor(view(CV_8UC3), grey, cv::COLOR_BGR2GRAY);
      return grey;
    case PixelFormat::kY16:
    case PixelFormat::kY12:
    case PixelFormat::kY10:
      // OpenCV has no rows of words at odd distances: bytes, then words.
      cv::Mat(height, 2 * width, CV_8UC1, data, buffer.picture.stride).copyTo(grey);
      grey = grey.reshape(2).clone();
      grey = cv::Mat(height, width, CV_16UC1, grey.data).clone();
      cv::bitwise_and(grey, cv::Scalar((1 << facts_of(buffer.picture.format).bits) - 1), grey);
      return grey;
    case PixelFormat::kMjpg:
      break;
  }
  return cv::imdecode(buffer.bytes, cv::IMREAD_GRAYSCALE);
}

/// Rows of the field that is not used become the means of their neighbours.
inline cv::Mat one_field_by_opencv(const cv::Mat& grey, FieldUse fields) {
  if (fields == FieldUse::kBoth || grey.rows < 2) {
    return grey;
  }
  const int used = fields == FieldUse::kTop ? 0 : 1;
  cv::Mat exact;
  grey.convertTo(exact, CV_32S);
  cv::Mat filled = exact.clone();
  for (int y = 1 - used; y < grey.rows; y += 2) {
    const int above = y > 0 ? y - 1 : y + 1;
    const int below = y + 1 < grey.rows ? y + 1 : y - 1;
    for (int x = 0; x < grey.cols; ++x) {
      filled.at<int>(y, x) = (exact.at<int>(above, x) + exact.at<int>(below, x) + 1) / 2;
    }
  }
  cv::Mat picture;
  filled.convertTo(picture, grey.type());
  return picture;
}

inline cv::Mat shape_by_opencv(const cv::Mat& card, const PictureShape& shape) {
  const cv::Mat grey = one_field_by_opencv(card, shape.fields);
  const PictureArea crop = crop_of(shape, {grey.cols, grey.rows});
  const int d = shape.decimation;
  const cv::Size size(crop.width / d, crop.height / d);
  cv::Mat picture = grey(cv::Rect(crop.x, crop.y, size.width * d, size.height * d)).clone();
  if (d > 1) {
    cv::Mat exact;
    picture.convertTo(exact, CV_64F);
    cv::resize(exact, exact, size, 0, 0, cv::INTER_AREA);
    exact.convertTo(picture, picture.type());
  }
  if (shape.flip != Flip::kNone) {
    cv::flip(picture, picture, shape.flip == Flip::kBoth ? -1 : shape.flip == Flip::kHorizontal ? 1 : 0);
  }
  if (shape.rotation != Rotation::k0) {
    cv::rotate(picture, picture, static_cast<int>(shape.rotation) - 1);
  }
  return picture;
}

/// What the converter makes of it; empty when it is refused.
inline cv::Mat convert(GreyConverter& converter, const CardBuffer& buffer) {
  if (!converter.begin(buffer.picture)) {
    return {};
  }
  const int type = converter.depth() == PixelDepth::kGrey8 ? CV_8UC1 : CV_16UC1;
  cv::Mat picture(converter.size().height, converter.size().width, type);
  const std::span<std::uint8_t> pixels(picture.data, converter.delivered_bytes());
  return converter.convert(buffer.bytes, pixels) ? picture : cv::Mat();
}

inline double max_difference(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() ? cv::norm(a, b, cv::NORM_INF) : 1e9;
}

inline PictureShape any_shape(PictureSize card) {
  PictureShape shape;
  shape.fields = *rc::gen::element(FieldUse::kBoth, FieldUse::kTop, FieldUse::kBottom);
  shape.decimation = *rc::gen::inRange(1, std::min({card.width, card.height, 6}) + 1);
  shape.flip = *rc::gen::element(Flip::kNone, Flip::kHorizontal, Flip::kVertical, Flip::kBoth);
  shape.rotation = *rc::gen::element(Rotation::k0, Rotation::k90, Rotation::k180, Rotation::k270);
  if (*rc::gen::arbitrary<bool>()) {
    shape.crop.width = *rc::gen::inRange(shape.decimation, card.width + 1);
    shape.crop.height = *rc::gen::inRange(shape.decimation, card.height + 1);
    shape.crop.x = *rc::gen::inRange(0, card.width - shape.crop.width + 1);
    shape.crop.y = *rc::gen::inRange(0, card.height - shape.crop.height + 1);
  }
  return shape;
}

}  // namespace tubed
