// A fluoroscope behind shared memory: a frame grabber's program writes, this source reads.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/image_shm/allowance.hpp"
#include "drivers/interface/condition.hpp"
#include "drivers/interface/fed_locally.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/interface/room.hpp"
#include "idl/shm_reader.hpp"

namespace tubed {

/// One view. Called by that view's image grab thread. Copies the pixels once, from the shared memory into the
/// frame. Hands out the newest image and drops the others. A writer that says goodbye, hangs or dies is
/// kLost, and open() finds its next start. Never writes anything that the writer could feel.
class ShmImageSource final : public ImageSource, public HasCondition, public IsFedLocally {
 public:
  /// `socket`: path; `trusted`: the users the writer may run as.
  ShmImageSource(const CameraCalibration& camera, std::string socket, std::vector<uid_t> trusted);

  /// Refuses memory larger than 16 images of 16 bit of this camera: it would cost the daemon's memory.
  OpenResult open() override;
  /// Refuses what contradicts itself: unknown origin or depth, fewer pixels than its size says, an exposure
  /// of the future or not after the one before, be it of an earlier start of the writer. Looks at no more
  /// than 500 images a second, after a burst of 32, and is woken no more often by a writer that rings without
  /// an image: after a burst of 32 it looks by the clock, every 2 ms. A writer gone mad does not keep a
  /// real-time thread busy. An image of another size than the camera's is handed on
  /// without its pixels: the checks of images say so by name.
  ReadOutcome read(ImageFrame& frame) noexcept override;
  /// Until the writer rings with an image, is silent or has ended; where read() or the writer was paced,
  /// until it may look again.
  void wait(MonotonicTime deadline) noexcept override;
  void close() noexcept override;
  /// Its words name a writer that rings without an image, or has more images than are looked at, and why the
  /// newest image was refused.
  SourceCondition condition() noexcept override;

 private:
  void pause(MonotonicTime now, MonotonicTime deadline) noexcept;
  /// kNothing: the writer overtook it, so that there is a newer one.
  ReadOutcome take(ImageFrame& frame, MonotonicTime now) noexcept;
  /// Why an image cannot be used; null when it can.
  [[nodiscard]] const char* refusal_of(const tubed_shm_image& image, std::size_t payload_bytes,
                                       MonotonicTime now) const noexcept;

  CameraCalibration camera_;
  std::string socket_;
  std::vector<uid_t> trusted_;
  std::optional<ShmReader> reader_;
  std::int64_t newest_exposure_ns_ = 0;
  Allowance looks_;
  Allowance rings_;                ///< of those without an image
  MonotonicTime paced_{};          ///< when one of the two was used up last
  bool may_not_look_ = false;      ///< there is an image, and its look was not allowed
  const char* refusal_ = nullptr;  ///< of the newest image looked at
  bool delivers_ = false;          ///< since it was opened
  bool has_delivered_ = false;     ///< at any time
};

}  // namespace tubed
