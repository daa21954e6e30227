// A folder that several sources of this process replay together: read once, decoded once, started once.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/interface/timestamps.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "drivers/replay/sequence_image.hpp"

namespace tubed {

/// The exposures of one camera, decoded.
struct ReplayedView {
  bool decoded = false;
  std::vector<SequenceFrame> rows;  ///< this camera's rows of frames.csv
  std::vector<GreyImage> images;    ///< one a row; without pixels where fluoroscopy is off
};

/// What the sources of one folder share. A view is written once, under the registry's lock, before its own
/// source reads it; everything else does not change after loading. So reading needs no lock.
struct ReplayedFolder {
  Sequence sequence;
  std::vector<ReplayedView> views;  ///< one a camera of the sequence
  std::chrono::nanoseconds lap{1};  ///< from the first time to the last plus one mean period
  MonotonicTime start{};            ///< when time 0 of the sequence is, unless a source was told otherwise
};

/// A source's share of a folder. Held from the making of the source to its end: the folder is forgotten (and
/// would be started anew) with its last lease. Leases are taken, opened and given back under one mutex of the
/// process; call none of it in read().
class FolderLease {
 public:
  /// Registers interest in a folder and, for an image source, in the named camera. Touches no file of it.
  FolderLease(const std::filesystem::path& folder, std::string camera);
  ~FolderLease();
  FolderLease(const FolderLease&) = delete;
  FolderLease& operator=(const FolderLease&) = delete;

  /// The first lease that opens reads the folder, decodes the views of all cameras leased so far, and only
  /// then sets the start, 300 ms ahead: no source is late because another took long to open. Throws
  /// SequenceError; then the next call tries again.
  const ReplayedFolder& open(std::int64_t memory_limit_mb);

 private:
  struct Entry;
  struct Registry;
  static Registry& registry();

  Entry* entry_;
  std::string camera_;
};

}  // namespace tubed
