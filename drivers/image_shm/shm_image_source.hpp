// A fluoroscope behind shared memory: a frame grabber's program writes, this source reads.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/interface/room.hpp"
#include "idl/shm_reader.hpp"

namespace tubed {

/// One view. Called by that view's image grab thread. Copies the pixels once, from the shared memory into the
/// frame. Hands out the newest image and drops the others. A writer that says goodbye, hangs or dies is
/// kLost, and open() finds its next start. Never writes anything that the writer could feel.
class ShmImageSource final : public ImageSource {
 public:
  /// `socket`: path; `trusted`: the users the writer may run as.
  ShmImageSource(const CameraCalibration& camera, std::string socket, std::vector<uid_t> trusted);

  OpenResult open() override;
  /// Refuses what contradicts itself: unknown origin or depth, fewer pixels than its size says, an exposure
  /// of the future or not after the one before, be it of an earlier start of the writer. Looks at no more
  /// than 500 images a second, after a burst of 32: a writer gone mad does not keep a real-time thread busy.
  /// An image of another size than the camera's is handed on
  /// without its pixels: the checks of images say so by name.
  ReadOutcome read(ImageFrame& frame, MonotonicTime deadline) noexcept override;
  void close() noexcept override { reader_.reset(); }

 private:
  enum class Taken { kFrame, kRefused, kOvertaken };
  bool may_look(std::int64_t now_ns) noexcept;
  Taken take(ImageFrame& frame, MonotonicTime now) noexcept;
  [[nodiscard]] bool is_plausible(const tubed_shm_image& image, std::size_t payload_bytes,
                                  MonotonicTime now) const noexcept;

  CameraCalibration camera_;
  std::string socket_;
  std::vector<uid_t> trusted_;
  std::optional<ShmReader> reader_;
  std::int64_t newest_exposure_ns_ = 0;
  std::int64_t looked_until_ns_ = 0;  ///< what the looks so far have used up of the time
};

}  // namespace tubed
