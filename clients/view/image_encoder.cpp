#include "clients/view/image_encoder.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace tubed {

namespace {

std::string framed(const nlohmann::json& head, std::span<const std::uint8_t> jpeg) {
  const std::string words = head.dump();
  std::string payload;
  payload.reserve(4 + words.size() + jpeg.size());
  for (unsigned shift = 0; shift < 32; shift += 8)
    payload += static_cast<char>((words.size() >> shift) & 0xFFU);
  payload += words;
  payload.append(jpeg.begin(), jpeg.end());
  return payload;
}

/// How the view stood for this image; null where the room says it for all of them.
nlohmann::json view_json(const tubed_shm_image& head) {
  if (head.geometry != TUBED_SHM_GEOMETRY) return {};
  return {{"f", {head.fx, head.fy}},
          {"c", {head.cx, head.cy}},
          {"q", head.q_camera_world},
          {"t", head.t_camera_world_mm}};
}

}  // namespace

SharedMessage ImageEncoder::encode(const RawImage& image, std::uint64_t number, std::int64_t received_ns) {
  int shrunk = 1;
  const std::span<const std::uint8_t> jpeg =
      image.pixels.empty() ? std::span<const std::uint8_t>() : jpeg_of(image, shrunk);
  auto message = std::make_shared<Message>();
  message->kind = MessageKind::kImage;
  message->about = camera_;
  message->number = number;
  message->is_binary = true;
  message->payload = framed({{"type", "image"},
                             {"camera", camera_},
                             {"n", message->number},
                             {"frame", image.head.frame_number},
                             {"exposed_at", static_cast<double>(image.head.exposure_ns) * 1e-6},
                             {"view", view_json(image.head)},
                             {"on", image.head.fluoroscopy_on != 0},
                             {"origin", image.head.origin},
                             {"width", image.head.width},
                             {"height", image.head.height},
                             {"shrunk", shrunk},
                             {"black", std::lround(pictures_.window().black)},
                             {"white", std::lround(pictures_.window().white)},
                             {"received", static_cast<double>(received_ns) * 1e-6}},
                            jpeg);
  return message;
}

std::span<const std::uint8_t> ImageEncoder::jpeg_of(const RawImage& image, int& shrunk) {
  GreyPicture& picture = pictures_.take(image);
  shrunk = shrink(picture, settings_.max_side);
  return encoder_.encode(picture, settings_.quality);
}

}  // namespace tubed
