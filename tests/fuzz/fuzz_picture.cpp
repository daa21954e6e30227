// What a capture card has written into its buffer: pixels of every format, Motion JPEG among them.
// libjpeg-turbo itself is Debian's and not instrumented: what it writes and allocates is watched, its own
// reads are not.
#include <memory>
#include <vector>

#include "drivers/v4l2/grey_converter.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

PictureShape shape_of(FuzzInput& input) {
  PictureShape shape;
  shape.fields = static_cast<FieldUse>(input.take<std::uint8_t>() % 3);
  shape.decimation = 1 + input.take<std::uint8_t>() % 8;
  shape.flip = static_cast<Flip>(input.take<std::uint8_t>() % 4);
  shape.rotation = static_cast<Rotation>(input.take<std::uint8_t>() % 4);
  shape.crop = {input.take<std::int8_t>(), input.take<std::int8_t>(), input.take<std::uint8_t>(),
                input.take<std::uint8_t>()};
  return shape;
}

CardPicture picture_of(FuzzInput& input) {
  CardPicture picture;
  picture.format = static_cast<PixelFormat>(input.take<std::uint8_t>() % pixel_formats().size());
  picture.size = {input.take<std::uint8_t>(), input.take<std::uint8_t>()};
  picture.stride = input.take<std::uint16_t>();
  return picture;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzInput input(data, size);
  const std::uint8_t coding = input.take<std::uint8_t>();
  const PictureShape shape = shape_of(input);
  const auto converter =
      std::make_unique<GreyConverter>(shape, GreyCoding{(coding & 1) != 0, (coding & 2) != 0 ? 2.2 : 1.0});
  const CardPicture picture = picture_of(input);
  if (!converter->begin(picture)) {
    demand(!converter->why().empty());
    return 0;
  }
  const std::span<const std::uint8_t> bytes = input.take_bytes(size);
  demand(converter->delivered_bytes() == static_cast<std::size_t>(converter->size().width) *
                                             static_cast<std::size_t>(converter->size().height) *
                                             (converter->depth() == PixelDepth::kGrey8 ? 1 : 2));
  std::vector<std::uint8_t> first(converter->delivered_bytes());
  std::vector<std::uint8_t> second(converter->delivered_bytes());
  const bool is_picture = converter->convert(bytes, first);
  demand(is_picture || !converter->why().empty());
  demand(converter->convert(bytes, second) == is_picture);
  demand(!is_picture || first == second);
  std::vector<std::uint8_t> too_small(first.size() - 1);
  demand(!converter->convert(bytes, too_small));
  return 0;
}
