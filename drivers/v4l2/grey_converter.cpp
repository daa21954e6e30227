#include "drivers/v4l2/grey_converter.hpp"

#include <algorithm>

#include "drivers/v4l2/grey_rows.hpp"

namespace tubed {

namespace {

std::size_t unsigned_of(int number) { return static_cast<std::size_t>(number); }

}  // namespace

GreyConverter::GreyConverter(const PictureShape& shape, const GreyCoding& coding)
    : shape_(shape), levels_(coding), row_(kMaxSide), sums_(kMaxSide) {}

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
    const auto row =
        bytes.subspan(unsigned_of(kept_.y + y) * picture_.stride + unsigned_of(kept_.x) * pixel_bytes);
    if (is_copied) {
      unpack_row(picture_.format, row,
                 std::span(pixels + places_.origin + y * places_.step_y, unsigned_of(kept_.width)));
      continue;
    }
    const auto grey = row_memory<Pixel>(kept_.width);
    unpack_row(picture_.format, row, grey);
    take_row(grey, y, pixels);
  }
  return true;
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
  const auto grey = whole.subspan(unsigned_of(kept_.x), unsigned_of(kept_.width));
  for (int y = 0; y < kept_.y + kept_.height; ++y) {
    if (!jpeg_.read_row(whole)) {
      why_ = jpeg_.why();
      return false;
    }
    if (y >= kept_.y) {
      take_row(grey, y - kept_.y, pixels);
    }
  }
  jpeg_.end();
  return true;
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
