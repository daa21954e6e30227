#include "drivers/v4l2/card_survey.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "drivers/v4l2/card_words.hpp"
#include "drivers/v4l2/pixel_format.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::uint32_t kMax = 32;
constexpr std::size_t kMaxText = 64;

template <std::size_t size>
std::string text_of(const std::uint8_t (&field)[size]) {
  const auto* const begin = reinterpret_cast<const char*>(field);
  return printable_text({begin, ::strnlen(begin, size)}, kMaxText);
}

std::string letters_of(std::uint32_t fourcc) {
  std::string letters;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    letters += static_cast<char>(fourcc >> shift & 0x7FU);
  }
  return printable_text(letters, kMaxText);
}

double rate_of(VideoDevice& device, std::uint32_t fourcc, PictureSize size) {
  v4l2_frmivalenum interval{};
  interval.pixel_format = fourcc;
  interval.width = static_cast<std::uint32_t>(size.width);
  interval.height = static_cast<std::uint32_t>(size.height);
  double max_hz = 0;
  for (; interval.index < kMax && device.control(VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0;
       ++interval.index) {
    const v4l2_fract& shortest =
        interval.type == V4L2_FRMIVAL_TYPE_DISCRETE ? interval.discrete : interval.stepwise.min;
    max_hz = shortest.numerator == 0
                 ? max_hz
                 : std::max(max_hz, static_cast<double>(shortest.denominator) / shortest.numerator);
    if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE) break;
  }
  return max_hz;
}

std::vector<OfferedSize> sizes_of(VideoDevice& device, std::uint32_t fourcc) {
  std::vector<OfferedSize> sizes;
  v4l2_frmsizeenum each{};
  each.pixel_format = fourcc;
  for (; each.index < kMax && device.control(VIDIOC_ENUM_FRAMESIZES, &each) == 0; ++each.index) {
    const bool is_one = each.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    const PictureSize size =
        is_one ? PictureSize{static_cast<int>(each.discrete.width), static_cast<int>(each.discrete.height)}
               : PictureSize{static_cast<int>(each.stepwise.max_width),
                             static_cast<int>(each.stepwise.max_height)};
    sizes.push_back({size, !is_one, rate_of(device, fourcc, size)});
    if (!is_one) break;
  }
  return sizes;
}

std::vector<OfferedFormat> formats_of(VideoDevice& device) {
  std::vector<OfferedFormat> formats;
  v4l2_fmtdesc each{};
  each.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; each.index < kMax && device.control(VIDIOC_ENUM_FMT, &each) == 0; ++each.index) {
    const auto format = pixel_format_of_fourcc(each.pixelformat);
    formats.push_back({format ? std::string(facts_of(*format).word) : letters_of(each.pixelformat),
                       format.has_value(), sizes_of(device, each.pixelformat)});
  }
  return formats;
}

PictureSize signal_of(VideoDevice& device, const v4l2_input& input) {
  v4l2_dv_timings timings{};
  if ((input.capabilities & V4L2_IN_CAP_DV_TIMINGS) == 0 ||
      device.control(VIDIOC_QUERY_DV_TIMINGS, &timings) != 0) {
    return {};
  }
  return {static_cast<int>(timings.bt.width), static_cast<int>(timings.bt.height)};
}

std::vector<OfferedInput> inputs_of(VideoDevice& device, int chosen) {
  constexpr std::uint32_t kNoSignal = V4L2_IN_ST_NO_POWER | V4L2_IN_ST_NO_SIGNAL | V4L2_IN_ST_NO_SYNC |
                                      V4L2_IN_ST_NO_H_LOCK | V4L2_IN_ST_NO_V_LOCK;
  std::vector<OfferedInput> inputs;
  v4l2_input each{};
  for (; each.index < kMax && device.control(VIDIOC_ENUMINPUT, &each) == 0; ++each.index) {
    const int number = static_cast<int>(each.index);
    inputs.push_back({number, text_of(each.name), (each.status & kNoSignal) == 0,
                      number == chosen ? signal_of(device, each) : PictureSize{}});
  }
  return inputs;
}

std::string text_of(PictureSize size) { return std::string(describe(size).text()); }

/// "grey up to 1920 x 1080 at 60 Hz"
std::string text_of(const OfferedFormat& format) {
  const auto largest = std::max_element(format.sizes.begin(), format.sizes.end(),
                                        [](const OfferedSize& a, const OfferedSize& b) {
                                          return a.size.width * a.size.height < b.size.width * b.size.height;
                                        });
  if (largest == format.sizes.end()) {
    return format.name;
  }
  std::string text = format.name + " up to " + text_of(largest->size);
  if (largest->max_rate_hz > 0) {
    char rate[32];
    std::snprintf(rate, sizeof(rate), " at %.3g Hz", largest->max_rate_hz);
    text += rate;
  }
  return text;
}

void ask(VideoDevice& device, CardOffer& offer) {
  v4l2_capability card{};
  if ((offer.error = device.control(VIDIOC_QUERYCAP, &card)) != 0) {
    return;
  }
  const std::uint32_t can =
      (card.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? card.device_caps : card.capabilities;
  offer.captures = (can & V4L2_CAP_VIDEO_CAPTURE) != 0 && (can & V4L2_CAP_STREAMING) != 0;
  offer.name = text_of(card.card);
  offer.driver = text_of(card.driver);
  offer.bus = text_of(card.bus_info);
  if (!offer.captures) {
    return;
  }
  device.control(VIDIOC_G_INPUT, &offer.input);
  offer.inputs = inputs_of(device, offer.input);
  offer.formats = formats_of(device);
  v4l2_format now{};
  now.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device.control(VIDIOC_G_FMT, &now) == 0) {
    offer.size = {static_cast<int>(now.fmt.pix.width), static_cast<int>(now.fmt.pix.height)};
  }
}

}  // namespace

CardOffer survey_card(VideoDevice& device, const std::string& path) {
  CardOffer offer;
  offer.path = path;
  offer.error = device.open(path.c_str());
  if (offer.error == 0) {
    ask(device, offer);
    device.close();
  }
  return offer;
}

std::string describe(const CardOffer& offer) {
  std::string text = offer.name + " (" + offer.driver + ", " + offer.bus + ")";
  for (const OfferedInput& input : offer.inputs) {
    text += "; input " + std::to_string(input.number) + " " + input.name +
            (input.number == offer.input ? ", chosen" : "") + (input.has_signal ? "" : ", no signal") +
            (input.signal_size.width > 0 ? ", signal " + text_of(input.signal_size) : "");
  }
  text += "; set to " + text_of(offer.size) + "; formats that are read: ";
  std::string formats;
  for (const OfferedFormat& format : offer.formats) {
    if (format.is_read) {
      formats += (formats.empty() ? "" : ", ") + text_of(format);
    }
  }
  return text + (formats.empty() ? "none" : formats);
}

}  // namespace tubed
