// The shapes of a recording, made one after the other while somebody already looks at the first.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "EmSamples.h"
#include "TubeEstimate.h"
#include "clients/evaluation/configured_sequence.hpp"
#include "clients/evaluation/evaluation.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/playback/playback_messages.hpp"

namespace tubed {

/// What is shown of one instant.
struct PlayedInstant {
  tubed_TubeEstimate fused;       ///< in the mode that was asked for
  tubed_TubeEstimate coils_only;  ///< in mode `em`; without points where nobody asked for more than that
  tubed_EmSamples coils;          ///< the newest measurement; no coils before the first
};

/// Reconstructs a recording in a thread of its own, as `tubectl reconstruct` does, beside it from the coils
/// alone, and keeps what it made in a file without a name: some 20 KB an instant in the folder for temporary
/// files.
class PlayedShapes {
 public:
  /// `run` outlives this object. Throws std::system_error without room for the file.
  explicit PlayedShapes(const ConfiguredSequence& run);
  ~PlayedShapes();
  PlayedShapes(const PlayedShapes&) = delete;
  PlayedShapes& operator=(const PlayedShapes&) = delete;

  [[nodiscard]] const std::vector<SequenceInstant>& instants() const { return instants_; }
  /// Any thread: how many are made, from the first on.
  [[nodiscard]] std::size_t ready() const { return ready_; }
  /// Any thread. Precondition: instant < ready(). Throws std::system_error when the file cannot be read.
  void read(std::size_t instant, PlayedInstant& into) const;
  /// Any thread: appends the summaries from `summaries.size()` on that are ready.
  void add_summaries(std::vector<InstantSummary>& summaries) const;
  /// Any thread: why there will be no more; empty while nothing is wrong.
  [[nodiscard]] std::string trouble() const;

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void make();
  void make_all();
  void keep(std::size_t instant, const PlayedInstant& made);

  const ConfiguredSequence& run_;
  std::vector<SequenceInstant> instants_;
  TrueRun truth_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::atomic<std::size_t> ready_{0};
  std::atomic<bool> must_end_{false};
  mutable std::mutex mutex_;               ///< of the two below
  std::vector<InstantSummary> summaries_;  ///< of all that are ready
  std::string trouble_;
  std::thread thread_;
};

}  // namespace tubed
