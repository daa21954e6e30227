#pragma once

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/replay/playhead.hpp"
#include "drivers/replay/replayed_folder.hpp"

namespace tubed {

/// One view of a sequence folder's fluoroscope. Called by that view's image grab thread. frame_number is the
/// row's `frame`; looping, it goes on growing. Opened again after close() it goes on where it was.
class ReplayImageSource final : public ImageSource {
 public:
  ReplayImageSource(const CameraCalibration& camera, const DriverSettings& settings);

  OpenResult open() override;
  void wait(MonotonicTime deadline) noexcept override;
  ReadOutcome read(ImageFrame& frame) noexcept override;
  void close() noexcept override { is_open_ = false; }

 private:
  void find_view(const ReplayedFolder& folder);

  CameraCalibration camera_;
  DriverSettings settings_;
  FolderLease lease_;
  const ReplayedView* view_ = nullptr;  ///< once opened; lives as long as lease_
  Playhead playhead_;
  std::uint32_t numbers_a_lap_ = 1;
  bool is_open_ = false;
};

}  // namespace tubed
