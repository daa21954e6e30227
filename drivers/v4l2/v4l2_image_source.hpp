#pragma once

#include <memory>
#include <optional>

#include "drivers/interface/condition.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/v4l2/card_stream.hpp"
#include "drivers/v4l2/held_pictures.hpp"
#include "drivers/v4l2/v4l2_settings.hpp"

namespace tubed {

/// A fluoroscope's signal at a capture card or USB grabber. Called by that view's image grab thread.
///
/// The card is looked for by read() itself, so that one that comes back is found at once: open() always
/// succeeds, and what is wrong meanwhile stands in condition(). A card that is not there or has no signal is
/// looked for ten times a second; one that cannot be set up is tried again after 0.1 to 2 s. One call blocks
/// inside read(), and only while nothing is delivered: setting a card up, some 100 ms for USB devices.
class V4l2ImageSource final : public ImageSource, public HasCondition {
 public:
  struct Counts {
    std::uint64_t pictures = 0;   ///< delivered
    std::uint64_t refused = 0;    ///< damaged, or with impossible times
    std::uint64_t lost = 0;       ///< gaps in the card's count
    std::uint64_t overtaken = 0;  ///< a newer one had come before they were read
    std::uint64_t held = 0;       ///< showed the one before again
    std::uint64_t starts = 0;     ///< of the card's stream
  };

  /// `camera`: of the delivered pictures, see deliver_camera(). settings.request.path is the device.
  V4l2ImageSource(CameraCalibration camera, const V4l2Settings& settings,
                  std::unique_ptr<VideoDevice> device);
  ~V4l2ImageSource() override { V4l2ImageSource::close(); }

  OpenResult open() override;
  void wait(MonotonicTime deadline) noexcept override;
  /// The exposure is the kernel's time stamp, or the arrival where the card has none of CLOCK_MONOTONIC or
  /// one of the future. With held_after_ms set, a picture that shows the one
  /// before again is kNothing, and an image with fluoroscopy off when no other has come for so long.
  ReadOutcome read(ImageFrame& frame) noexcept override;
  void close() noexcept override;
  SourceCondition condition() noexcept override;

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] const CardStream& stream() const noexcept { return stream_; }

 private:
  void try_to_start(MonotonicTime now) noexcept;
  bool fits() noexcept;
  bool take_newest(ArrivedPicture& newest, MonotonicTime now) noexcept;
  void count(const ArrivedPicture& picture, MonotonicTime now) noexcept;
  ReadOutcome deliver(const ArrivedPicture& picture, ImageFrame& frame, MonotonicTime now) noexcept;
  bool is_held(const ImageFrame& frame, MonotonicTime now) noexcept;
  ReadOutcome refuse(std::string_view why) noexcept;
  void look_after(MonotonicTime now) noexcept;
  void lose(const CardWords& why, MonotonicTime now) noexcept;
  [[nodiscard]] std::chrono::nanoseconds silence() const noexcept;
  [[nodiscard]] CardWords note(MonotonicTime now) const noexcept;

  CameraCalibration camera_;
  V4l2Settings settings_;
  CardStream stream_;
  GreyConverter converter_;
  HeldPictures held_;
  Counts counts_;
  CardWords trouble_;         ///< while nothing is delivered
  std::string_view refusal_;  ///< of the newest picture; empty: it was good
  bool has_delivered_ = false;
  bool delivers_ = false;
  bool is_silent_ = false;
  bool has_stamps_ = true;
  std::optional<std::uint32_t> sequence_;  ///< of the newest picture of this stream
  std::uint32_t frame_number_ = 0;
  MonotonicTime newest_exposure_{};
  MonotonicTime last_arrival_{};  ///< or when the stream started
  MonotonicTime last_delivery_{};
  MonotonicTime last_new_{};  ///< when a picture came that was not held
  MonotonicTime last_loss_{};
  MonotonicTime last_ahead_{};  ///< when a picture's stamp was ahead of its arrival
  MonotonicTime next_look_{};   ///< for a signal
  MonotonicTime next_try_{};
  std::chrono::nanoseconds back_off_{};
  int empty_wakes_ = 0;  ///< since the last picture
};

}  // namespace tubed
