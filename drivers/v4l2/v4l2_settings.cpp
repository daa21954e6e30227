#include "drivers/v4l2/v4l2_settings.hpp"

#include <cstdlib>

namespace tubed {

namespace {

constexpr double kMaxPx = GreyConverter::kMaxSide;
constexpr int kMinSide = 64;  // of a [[camera]]

KeyDescription pixels(const char* name, std::size_t count, double minimum, const char* meaning) {
  return {.name = name,
          .default_value = std::vector<std::int64_t>{},
          .unit = "px",
          .minimum = minimum,
          .maximum = kMaxPx,
          .maximum_count = count,
          .meaning = meaning};
}

FieldUse fields_of(const std::string& word) {
  return word == "top" ? FieldUse::kTop : word == "bottom" ? FieldUse::kBottom : FieldUse::kBoth;
}

std::chrono::nanoseconds from_ms(double ms) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(ms * 1e6));
}

Flip flip_of(const std::string& word) {
  return word == "horizontal" ? Flip::kHorizontal
         : word == "vertical" ? Flip::kVertical
         : word == "both"     ? Flip::kBoth
                              : Flip::kNone;
}

PictureSize size_of(const std::vector<std::int64_t>& sides) {
  return sides.size() == 2 ? PictureSize{static_cast<int>(sides[0]), static_cast<int>(sides[1])}
                           : PictureSize{};
}

PictureArea area_of(const std::vector<std::int64_t>& numbers) {
  return numbers.size() == 4 ? PictureArea{static_cast<int>(numbers[0]), static_cast<int>(numbers[1]),
                                           static_cast<int>(numbers[2]), static_cast<int>(numbers[3])}
                             : PictureArea{};
}

std::string text_of(PictureSize size) { return std::string(describe(size).text()); }

}  // namespace

std::vector<KeyDescription> v4l2_settings() {
  std::vector<std::string> formats{"any"};
  for (const PixelFormatFacts& facts : pixel_formats()) {
    formats.emplace_back(facts.word);
  }
  return {
      key::word("format", "any", formats,
                "format of pixels that is asked of the card; any = the first of these with which size and "
                "rate fit"),
      pixels(
          "size", 2, 1,
          "[width, height] asked of the card; left out = what [[camera]] needs, or with a crop what it has"),
      key::real("rate_hz", 0, "Hz", {0, 1000}, "pictures a second asked of the card; 0 = what it has"),
      key::integer("input", -1, "", {-1, 63},
                   "input of the card, as `tubectl doctor` counts them; -1 = where it is"),
      key::integer("buffers", 4, "", {2, CardStream::kMaxBuffers}, "pictures that the card may fill ahead"),
      key::word(
          "fields", "both", {"both", "top", "bottom"},
          "of an interlaced signal, which fields are used: with one of them what moves has no combs, and "
          "the rows between are the means of their neighbours"),
      pixels("crop", 4, 0, "[x, y, width, height] of the card's picture that is used; left out = all of it"),
      key::integer("decimation", 1, "", {1, 8}, "each square of so many pixels becomes one, their mean"),
      key::word("flip", "none", {"none", "horizontal", "vertical", "both"},
                "the card's picture is mirrored: it is turned back"),
      key::word("rotate_deg", "0", {"0", "90", "180", "270"}, "turn the picture clockwise"),
      key::word("camera_of", "card", {"card", "delivered"},
                "which picture [[camera]] describes: the card's, flip undone, from which the delivered one's "
                "camera follows, or the delivered one itself"),
      key::word("range", "full", {"full", "limited"},
                "limited = black is 16 and white 235 of 255, as video has it"),
      key::real("gamma", 1, "", {0.3, 3.5},
                "of the screen that the signal is made for, such as 2.2; 1 = grey values are linear"),
      key::real(
          "held_after_ms", 0, "ms", {0, 10000},
          "pictures that only show the one before again are no exposures: they are dropped, and when no "
          "other has come for so long fluoroscopy is off; 0 = every picture is an exposure"),
      key::real("held_noise_levels", 0.1, "grey levels", {0, 1000},
                "noise of the capture by which a picture shown again may differ: 0.1 for a digital signal, "
                "about 1 for an analog one")};
}

V4l2Settings v4l2_settings_of(const DriverSettings& settings) {
  V4l2Settings all;
  const auto input = settings.get<std::int64_t>("input");
  all.request.input = input < 0 ? std::nullopt : std::optional(static_cast<int>(input));
  all.request.format = pixel_format_of_word(settings.get<std::string>("format"));
  all.request.size = size_of(settings.get<std::vector<std::int64_t>>("size"));
  all.request.rate_hz = settings.get<double>("rate_hz");
  all.request.buffers = static_cast<int>(settings.get<std::int64_t>("buffers"));
  all.shape.fields = fields_of(settings.get<std::string>("fields"));
  all.shape.crop = area_of(settings.get<std::vector<std::int64_t>>("crop"));
  all.shape.decimation = static_cast<int>(settings.get<std::int64_t>("decimation"));
  all.shape.flip = flip_of(settings.get<std::string>("flip"));
  all.shape.rotation = static_cast<Rotation>(std::atoi(settings.get<std::string>("rotate_deg").c_str()) / 90);
  all.coding = {settings.get<std::string>("range") == "limited", settings.get<double>("gamma")};
  all.held_after = from_ms(settings.get<double>("held_after_ms"));
  all.held_noise_levels = settings.get<double>("held_noise_levels");
  all.camera_is_of_the_card = settings.get<std::string>("camera_of") == "card";
  return all;
}

std::string fault_of(const DriverSettings& settings) {
  const auto size = settings.get<std::vector<std::int64_t>>("size").size();
  const auto crop = settings.get<std::vector<std::int64_t>>("crop");
  if (size != 0 && size != 2) {
    return "size: expected [width, height]";
  }
  if (crop.size() != 0 && (crop.size() != 4 || crop[2] < 1 || crop[3] < 1)) {
    return "crop: expected [x, y, width, height], width and height at least 1";
  }
  return "";
}

std::string deliver_camera(CameraCalibration& camera, DriverSettings& settings) {
  if (std::string fault = fault_of(settings); !fault.empty()) {
    return fault;
  }
  const V4l2Settings asked = v4l2_settings_of(settings);
  const PictureSize given{camera.width, camera.height};
  const bool is_cropped = asked.shape.crop.width > 0;
  PictureSize card = asked.request.size;
  if (card == PictureSize{}) {
    card = asked.camera_is_of_the_card ? given : is_cropped ? card : card_size_for(asked.shape, given);
    if (card.width > 0) {
      settings = settings.with("size", std::vector<std::int64_t>{card.width, card.height});
    }
  }
  if (asked.camera_is_of_the_card && !(card == given)) {
    return "size is " + text_of(card) + " and [[camera]] " + text_of(given) +
           ": expected the same, or camera_of = \"delivered\"";
  }
  if (card == PictureSize{}) {
    return "";  // whatever the card has: the driver compares it when it is there
  }
  const PictureSize size = delivered_size(asked.shape, card);
  if (size.width < kMinSide || size.height < kMinSide) {
    return "crop and decimation leave " + text_of(size) + " of the card's " + text_of(card) +
           " pixels: expected a crop inside it and at least 64 x 64 pixels";
  }
  if (asked.camera_is_of_the_card) {
    camera = delivered_camera(asked.shape, camera);
  } else if (!(size == given)) {
    return "the card's " + text_of(card) + " pixels become " + text_of(size) + ", [[camera]] has " +
           text_of(given) + ": expected the same";
  }
  return "";
}

}  // namespace tubed
