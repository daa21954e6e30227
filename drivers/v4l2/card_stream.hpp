// A card's pictures: the dialogue of V4L2 from opening the device to taking buffers.
#pragma once

#include <linux/videodev2.h>

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "drivers/v4l2/card_words.hpp"
#include "drivers/v4l2/grey_converter.hpp"
#include "drivers/v4l2/video_device.hpp"

namespace tubed {

/// What is asked of a card.
struct CardRequest {
  std::string path;
  std::optional<int> input;           ///< of the card; nothing: the one it is at
  std::optional<PixelFormat> format;  ///< nothing: the first of pixel_formats() with which size and rate fit
  PictureSize size;                   ///< 0 x 0: the one it has
  double rate_hz = 0;                 ///< 0: the one it has
  int buffers = 4;                    ///< 2 to kMaxBuffers
};

/// One picture in a buffer of the card, until give_back().
struct ArrivedPicture {
  std::uint32_t buffer = 0;
  std::span<const std::uint8_t> bytes;  ///< what the card has filled
  std::uint32_t sequence = 0;           ///< the card's own count, lost ones included
  std::optional<MonotonicTime> stamp;   ///< the kernel's; nothing when it is not of CLOCK_MONOTONIC
  bool is_damaged = false;              ///< says the card
};

/// One thread. Only the constructor allocates. start() may take as long as the card's driver needs, some
/// 100 ms for many USB devices; all others end at once.
class CardStream {
 public:
  static constexpr int kMaxBuffers = 16;

  CardStream(std::unique_ptr<VideoDevice> device, CardRequest request)
      : device_(std::move(device)), request_(std::move(request)) {}
  ~CardStream() { stop(); }
  CardStream(const CardStream&) = delete;
  CardStream& operator=(const CardStream&) = delete;

  /// Opens the card, sets and checks input, signal, format, size and rate, and lets it deliver. False:
  /// trouble() says why, and it is closed again.
  bool start() noexcept;
  void stop() noexcept;
  [[nodiscard]] bool is_streaming() const noexcept { return is_streaming_; }

  enum class Arrival {
    kPicture,
    kNothing,
    kStopped,  ///< gone, failed or changed: trouble() says what; it is closed
  };
  Arrival take(ArrivedPicture& picture) noexcept;
  /// The card may fill that buffer again.
  void give_back(const ArrivedPicture& picture) noexcept;
  /// Asks the card whether it has a signal; false, and it is closed, when it has none: trouble() says so.
  /// True for a card that cannot tell.
  bool has_signal() noexcept;

  [[nodiscard]] const CardWords& trouble() const noexcept { return trouble_; }
  /// errno behind trouble(); 0: none.
  [[nodiscard]] int error() const noexcept { return error_; }

  // Of the stream that runs, or ran last.
  [[nodiscard]] const CardPicture& picture() const noexcept { return picture_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }  ///< 0: the card does not say
  /// A driver of the kernel that makes its pictures up, or hands on those of any program.
  [[nodiscard]] bool is_simulated() const noexcept { return is_simulated_; }
  [[nodiscard]] bool is_interlaced() const noexcept { return is_interlaced_; }

  [[nodiscard]] VideoDevice& device() noexcept { return *device_; }
  [[nodiscard]] const CardRequest& request() const noexcept { return request_; }

 private:
  bool fail(std::string_view doing, int error) noexcept;
  bool refuse(const CardWords& words) noexcept;
  bool open_device() noexcept;
  bool choose_input() noexcept;
  bool follow_signal() noexcept;
  bool choose_format() noexcept;
  bool offers(std::uint32_t fourcc) noexcept;
  bool set_format(PixelFormat format) noexcept;
  void set_rate() noexcept;
  bool take_buffers() noexcept;
  bool has_changed() noexcept;
  [[nodiscard]] static std::uint32_t trouble_of(std::uint32_t status) noexcept;

  std::unique_ptr<VideoDevice> device_;
  CardRequest request_;
  bool is_streaming_ = false;
  bool is_simulated_ = false;
  bool is_interlaced_ = false;
  v4l2_input input_{};  ///< as it was when the stream started
  CardPicture picture_;
  double rate_hz_ = 0;
  std::array<std::span<const std::uint8_t>, kMaxBuffers> buffers_{};
  CardWords trouble_;
  int error_ = 0;
};

}  // namespace tubed
