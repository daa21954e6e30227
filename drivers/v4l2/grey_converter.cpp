#include "drivers/v4l2/grey_converter.hpp"

#include <algorithm>

#include "drivers/v4l2/grey_rows.hpp"

namespace tubed {

namespace {

std::size_t unsigned_of(int number) { return static_cast<std::size_t>(number); }

/// The mean of both, rounded, in place of `row`.
template <typename Pixel>
void average(std::span<const Pixel> other, std::span<Pixel> row) {
  std::transform(row.begin(), row.end(), other.begin(), row.begin(),
                 [](Pixel a, Pixel b) { return static_cast<Pixel>((a + b + 1) / 2); });
}

}  // namespace

GreyConverter::GreyConverter(const PictureShape& shape, const GreyCoding& coding)
    : shape_(shape), levels_(coding), row_(kMaxSide), used_(kMaxSide), sums_(kMaxSide) {}

bool GreyConverter::begin(const CardPicture& picture) noexcept {
  const PixelFormatFacts& facts = facts_of(picture.format);
  picture_ = picture;
  delivered_ = {};
  if (picture.size.width > kMaxSide || picture.size.height > kMaxSide) {
    why_ = "it is larger than 8192 pixels";
    return false;
  }
  if (picture.stride < unsigned_of(std::max(picture.size.width, 0)) * facts.bytes_per_pixel) {
    why_ = "its rows are longer than the distance between them";
    return false;
  }
  delivered_ = delivered_size(shape_, picture.size);
  if (delivered_.width == 0) {
    why_ = "the crop reaches beyond it";
    return false;
  }
  const PictureSize upright =
      swaps_sides(shape_.rotation) ? PictureSize{delivered_.height, delivered_.width} : delivered_;
  const PictureArea crop = crop_of(shape_, picture.size);
  kept_ = {crop.x, crop.y, upright.width * shape_.decimation, upright.height * shape_.decimation};
  places_ = places_of(shape_, upright);
  if (!levels_.is_identity()) {
    levels_.set_bits(facts.bits);
  }
  return true;
}

std::size_t GreyConverter::delivered_bytes() const noexcept {
  return unsigned_of(delivered_.width) * unsigned_of(delivered_.height) *
         (depth() == PixelDepth::kGrey8 ? 1 : 2);
}

bool GreyConverter::convert(std::span<const std::uint8_t> bytes, std::span<std::uint8_t> pixels) noexcept {
  if (delivered_.width == 0 || pixels.size() < delivered_bytes()) {
    why_ = "it is larger than the camera's";
    return false;
  }
  if (picture_.format == PixelFormat::kMjpg) {
    return decode_rows(bytes, pixels.data());
  }
  // The buffer of a frame comes from operator new: aligned for every type.
  return depth() == PixelDepth::kGrey8 ? convert_rows(bytes, pixels.data())
                                       : convert_rows(bytes, reinterpret_cast<std::uint16_t*>(pixels.data()));
}

template <typename Pixel>
bool GreyConverter::convert_rows(std::span<const std::uint8_t> bytes, Pixel* pixels) noexcept {
  const std::size_t pixel_bytes = facts_of(picture_.format).bytes_per_pixel;
  const std::size_t needed = (unsigned_of(picture_.size.height) - 1) * picture_.stride +
                             unsigned_of(picture_.size.width) * pixel_bytes;
  if (bytes.size() < needed) {
    why_ = "it has fewer bytes than its size needs: the card lost a part of it";
    return false;
  }
  const bool is_copied = levels_.is_identity() && shape_.decimation == 1 && places_.step_x == 1;
  for (int y = 0; y < kept_.height; ++y) {
    if (is_copied) {
      unpack(bytes, kept_.y + y,
             std::span(pixels + places_.origin + y * places_.step_y, unsigned_of(kept_.width)));
      continue;
    }
    const auto grey = row_memory<Pixel>(kept_.width);
    unpack(bytes, kept_.y + y, grey);
    take_row(grey, y, pixels);
  }
  return true;
}

bool GreyConverter::is_used(int card_row) const noexcept {
  return shape_.fields == FieldUse::kBoth || card_row % 2 == (shape_.fields == FieldUse::kTop ? 0 : 1);
}

/// What of a row the crop keeps; one of the other field from the rows above and below it.
template <typename Pixel>
void GreyConverter::unpack(std::span<const std::uint8_t> bytes, int card_row,
                           std::span<Pixel> grey) noexcept {
  const std::size_t before = unsigned_of(kept_.x) * facts_of(picture_.format).bytes_per_pixel;
  const auto read = [&](int row, std::span<Pixel> to) {
    unpack_row(picture_.format, bytes.subspan(unsigned_of(row) * picture_.stride + before), to);
  };
  const int last = picture_.size.height - 1;
  if (is_used(card_row) || last == 0) {
    read(card_row, grey);
    return;
  }
  read(card_row > 0 ? card_row - 1 : card_row + 1, grey);
  if (card_row > 0 && card_row < last) {
    const std::span below(reinterpret_cast<Pixel*>(used_.data()), grey.size());
    read(card_row + 1, below);
    average(std::span<const Pixel>(below), grey);
  }
}

bool GreyConverter::decode_rows(std::span<const std::uint8_t> bytes, std::uint8_t* pixels) noexcept {
  if (!jpeg_.begin(bytes)) {
    why_ = jpeg_.why();
    return false;
  }
  if (!(jpeg_.size() == picture_.size)) {
    jpeg_.end();
    why_ = "its JPEG header says another size than the card";
    return false;
  }
  const auto whole = row_memory<std::uint8_t>(picture_.size.width);
  // Where one field is used a row that is filled in needs the one below it.
  const int one_more = shape_.fields == FieldUse::kBoth ? 0 : 1;
  for (int y = 0; y < std::min(kept_.y + kept_.height + one_more, picture_.size.height); ++y) {
    if (!jpeg_.read_row(whole)) {
      why_ = jpeg_.why();
      return false;
    }
    take_decoded(y, whole, pixels);
  }
  jpeg_.end();
  return true;
}

/// Rows come one after the other, and each is seen once: one of the other field is filled in when the one
/// below it has come, the last from the one above.
void GreyConverter::take_decoded(int card_row, std::span<std::uint8_t> whole, std::uint8_t* pixels) noexcept {
  const auto take = [&](std::span<std::uint8_t> row, int card) {
    if (card >= kept_.y && card < kept_.y + kept_.height) {
      take_row(row.subspan(unsigned_of(kept_.x), unsigned_of(kept_.width)), card - kept_.y, pixels);
    }
  };
  if (shape_.fields == FieldUse::kBoth) {
    take(whole, card_row);
    return;
  }
  const std::span above(reinterpret_cast<std::uint8_t*>(used_.data()), whole.size());
  if (is_used(card_row)) {
    if (card_row > 0) {
      if (card_row == 1) {
        std::copy(whole.begin(), whole.end(), above.begin());  // nothing is above row 0
      } else {
        average(std::span<const std::uint8_t>(whole), above);
      }
      take(above, card_row - 1);
    }
    std::copy(whole.begin(), whole.end(), above.begin());
    take(whole, card_row);
  } else if (card_row == picture_.size.height - 1) {
    take(card_row > 0 ? above : whole, card_row);
  }
}

template <typename Pixel>
void GreyConverter::take_row(std::span<Pixel> row, int y, Pixel* pixels) noexcept {
  if (!levels_.is_identity()) {
    std::transform(row.begin(), row.end(), row.begin(),
                   [&](Pixel value) { return static_cast<Pixel>(levels_[value]); });
  }
  const int d = shape_.decimation;
  if (d == 1) {
    place(std::span<const Pixel>(row), y, pixels);
    return;
  }
  add(std::span<const Pixel>(row), y % d == 0);
  if (y % d == d - 1) {
    const auto area = static_cast<std::uint32_t>(d * d);
    const auto mean = row.first(row.size() / unsigned_of(d));
    std::transform(sums_.begin(), sums_.begin() + static_cast<long>(mean.size()), mean.begin(),
                   [&](std::uint32_t sum) { return static_cast<Pixel>((sum + area / 2) / area); });
    place(std::span<const Pixel>(mean), y / d, pixels);
  }
}

template <typename Pixel>
void GreyConverter::add(std::span<const Pixel> row, bool is_first) noexcept {
  const std::size_t d = unsigned_of(shape_.decimation);
  for (std::size_t square = 0; square < row.size() / d; ++square) {
    std::uint32_t sum = is_first ? 0 : sums_[square];
    for (std::size_t x = square * d; x < (square + 1) * d; ++x) {
      sum += row[x];
    }
    sums_[square] = sum;
  }
}

template <typename Pixel>
void GreyConverter::place(std::span<const Pixel> row, int y, Pixel* pixels) const noexcept {
  Pixel* const first = pixels + places_.origin + y * places_.step_y;
  if (places_.step_x == 1) {
    std::copy(row.begin(), row.end(), first);
    return;
  }
  for (std::size_t x = 0; x < row.size(); ++x) {
    first[static_cast<long>(x) * places_.step_x] = row[x];
  }
}

}  // namespace tubed
