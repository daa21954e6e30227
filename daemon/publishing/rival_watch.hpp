// Watches for another publisher of the daemon's own instruments: a second daemon with the
// same configuration, or a forger.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/publishing/dds_settings.hpp"

namespace tubed {

class DdsEntity;

/// What is known of the rivals of one instrument.
struct RivalReport {
  bool is_there = false;     ///< a sample of its came within the last second
  bool has_changed = false;  ///< at the last look
  std::string who;           ///< the newest one, as far as DDS tells; printable
};

/// A reader of TubeEstimate that hears neither the daemon's own writer nor other instruments, and keeps one
/// sample of each. The publisher thread alone uses it; a look takes what is there, at most two samples an
/// instrument, and only the first one of a rival allocates.
class RivalWatch {
 public:
  /// `participant` is the one that publishes, and outlives this object. Throws DdsError.
  RivalWatch(const DdsEntity& participant, const DdsSettings& settings,
             std::vector<std::string> instrument_ids);
  ~RivalWatch();

  /// Takes what came; `now_ns` is CLOCK_MONOTONIC. True when a rival came or went.
  bool look(std::int64_t now_ns);

  /// In the order of the instruments.
  [[nodiscard]] const std::vector<RivalReport>& reports() const;

 private:
  struct Reader;
  std::unique_ptr<Reader> reader_;
};

}  // namespace tubed
