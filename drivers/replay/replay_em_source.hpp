#pragma once

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/replay/playhead.hpp"
#include "drivers/replay/replayed_folder.hpp"

namespace tubed {

/// The EM tracker of a sequence folder. Called by the EM acquisition thread. Looping, the tracker's frame
/// number goes on growing. Opened again after close() it goes on where it was.
class ReplayEmSource final : public EmSource {
 public:
  explicit ReplayEmSource(const DriverSettings& settings);

  OpenResult open() override;
  void wait(MonotonicTime deadline) noexcept override;
  ReadOutcome read(EmFrame& frame) noexcept override;
  void close() noexcept override { is_open_ = false; }

 private:
  DriverSettings settings_;
  FolderLease lease_;
  const ReplayedFolder* folder_ = nullptr;  ///< once opened; lives as long as lease_
  Playhead playhead_;
  std::uint32_t numbers_a_lap_ = 1;
  bool is_open_ = false;
};

}  // namespace tubed
