// A card's picture to the pipeline's grey image: unpacked, levels, cropped, decimated, turned.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/v4l2/grey_levels.hpp"
#include "drivers/v4l2/jpeg_picture.hpp"
#include "drivers/v4l2/picture_shape.hpp"
#include "drivers/v4l2/pixel_format.hpp"

namespace tubed {

/// How a card's picture lies in its buffer.
struct CardPicture {
  PixelFormat format = PixelFormat::kGrey;
  PictureSize size;
  std::size_t stride = 0;  ///< bytes from row to row of the grey plane; of kMjpg without meaning
};

/// One thread. Nothing but the constructor allocates. Grey formats that are not changed are copied row by
/// row, once, from the card's buffer into the frame.
class GreyConverter {
 public:
  static constexpr int kMaxSide = 8192;  ///< px, of a card's picture

  GreyConverter(const PictureShape& shape, const GreyCoding& coding);

  /// The pictures that will come. False: why() says why none of them could be converted.
  bool begin(const CardPicture& picture) noexcept;
  /// Size and depth of what is delivered.
  [[nodiscard]] PictureSize size() const noexcept { return delivered_; }
  [[nodiscard]] PixelDepth depth() const noexcept {
    return facts_of(picture_.format).bits == 8 ? PixelDepth::kGrey8 : PixelDepth::kGrey16;
  }
  /// Bytes of what is delivered.
  [[nodiscard]] std::size_t delivered_bytes() const noexcept;
  /// `bytes`: what the card has filled of its buffer. Writes delivered_bytes() to `pixels`, row by row, 16
  /// bit in host order. False: why() says why; `pixels` has a part of a picture then.
  bool convert(std::span<const std::uint8_t> bytes, std::span<std::uint8_t> pixels) noexcept;
  /// Constant text, for a message that begins "a picture was refused: ".
  [[nodiscard]] std::string_view why() const noexcept { return why_; }

 private:
  template <typename Pixel>
  bool convert_rows(std::span<const std::uint8_t> bytes, Pixel* pixels) noexcept;
  bool decode_rows(std::span<const std::uint8_t> bytes, std::uint8_t* pixels) noexcept;
  [[nodiscard]] bool is_used(int card_row) const noexcept;
  template <typename Pixel>
  void unpack(std::span<const std::uint8_t> bytes, int card_row, std::span<Pixel> grey) noexcept;
  void take_decoded(int card_row, std::span<std::uint8_t> whole, std::uint8_t* pixels) noexcept;
  template <typename Pixel>
  void take_row(std::span<Pixel> row, int y, Pixel* pixels) noexcept;
  template <typename Pixel>
  void add(std::span<const Pixel> row, bool is_first) noexcept;
  template <typename Pixel>
  void place(std::span<const Pixel> row, int y, Pixel* pixels) const noexcept;
  template <typename Pixel>
  [[nodiscard]] std::span<Pixel> row_memory(int width) noexcept {
    return {reinterpret_cast<Pixel*>(row_.data()), static_cast<std::size_t>(width)};
  }

  PictureShape shape_;
  GreyLevels levels_;
  JpegPicture jpeg_;
  CardPicture picture_;
  PictureArea kept_;  ///< of the card's picture: whole squares of the crop
  PictureSize delivered_;
  PicturePlaces places_;
  std::vector<std::uint16_t> row_;   ///< of the card's picture
  std::vector<std::uint16_t> used_;  ///< the used row before it, where one field is used
  std::vector<std::uint32_t> sums_;  ///< of each square of the rows so far
  std::string_view why_;
};

}  // namespace tubed
