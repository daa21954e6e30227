#include "drivers/replay/replayed_folder.hpp"

#include <algorithm>
#include <list>
#include <mutex>
#include <optional>
#include <utility>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kTimeToGetReady{300};
constexpr double kPeriodOfASingleInstant_s = 1.0 / 30;
constexpr std::int64_t kBytesPerMb = 1'000'000;

/// Mean distance of distinct times, 0 with fewer than two.
template <typename Rows>
double mean_period_s(const Rows& rows) {
  std::size_t steps = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    steps += rows[i].t_s > rows[i - 1].t_s ? 1 : 0;
  }
  return steps == 0 ? 0 : (rows.back().t_s - rows.front().t_s) / static_cast<double>(steps);
}

std::chrono::nanoseconds lap_of(const Sequence& sequence) {
  std::vector<double> ends_s;
  const auto add_ends = [&](const auto& rows) {
    if (!rows.empty()) {
      ends_s.insert(ends_s.end(), {rows.front().t_s, rows.back().t_s});
    }
  };
  add_ends(sequence.frames);
  add_ends(sequence.measurements);
  double period_s = std::max(mean_period_s(sequence.frames), mean_period_s(sequence.measurements));
  period_s = period_s > 0 ? period_s : kPeriodOfASingleInstant_s;
  const auto [first, last] = std::minmax_element(ends_s.begin(), ends_s.end());
  const double span_s = ends_s.empty() ? 0 : *last - *first;
  return to_nanoseconds(span_s + period_s);
}

std::int64_t decoded_bytes(const ReplayedFolder& folder) {
  std::int64_t bytes = 0;
  for (const ReplayedView& view : folder.views) {
    for (const GreyImage& image : view.images) {
      bytes += static_cast<std::int64_t>(image.pixels.size());
    }
  }
  return bytes;
}

void decode(ReplayedFolder& folder, std::size_t camera, std::int64_t memory_limit_mb) {
  std::int64_t left = memory_limit_mb * kBytesPerMb - decoded_bytes(folder);
  ReplayedView view;
  for (const SequenceFrame& row : folder.sequence.frames) {
    if (row.camera != static_cast<int>(camera)) {
      continue;
    }
    view.rows.push_back(row);
    view.images.push_back(row.fluoroscopy_on() ? read_image(folder.sequence, row) : GreyImage{});
    left -= static_cast<std::int64_t>(view.images.back().pixels.size());
    if (left < 0) {
      throw SequenceError(
          row.position,
          "the decoded images need more than memory_limit_mb = " + std::to_string(memory_limit_mb) +
              "; raise it if the machine has the memory, or shorten the sequence");
    }
  }
  view.decoded = true;
  folder.views[camera] = std::move(view);
}

std::filesystem::path one_name_for(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::path canonical = std::filesystem::weakly_canonical(folder, error);
  return error ? folder : canonical;
}

}  // namespace

struct FolderLease::Entry {
  std::filesystem::path folder;
  std::vector<std::string> cameras;  ///< one for each lease of an image source
  int leases = 0;
  std::optional<ReplayedFolder> loaded;
};

/// The only state that outlives its sources: which sources replay which folder. Every access holds the mutex,
/// also while a folder is read, so that the second source to open waits for the first. A list keeps entries
/// in place.
struct FolderLease::Registry {
  std::mutex mutex;
  std::list<Entry> entries;
};

FolderLease::Registry& FolderLease::registry() {
  static Registry registry;
  return registry;
}

FolderLease::FolderLease(const std::filesystem::path& folder, std::string camera)
    : camera_(std::move(camera)) {
  const std::filesystem::path name = one_name_for(folder);
  const std::lock_guard lock(registry().mutex);
  auto& entries = registry().entries;
  auto found =
      std::find_if(entries.begin(), entries.end(), [&](const Entry& entry) { return entry.folder == name; });
  if (found == entries.end()) {
    found = entries.insert(entries.end(), Entry{name, {}, 0, {}});
  }
  entry_ = &*found;
  ++entry_->leases;
  if (!camera_.empty()) {
    entry_->cameras.push_back(camera_);
  }
}

FolderLease::~FolderLease() {
  const std::lock_guard lock(registry().mutex);
  const auto mine = std::find(entry_->cameras.begin(), entry_->cameras.end(), camera_);
  if (mine != entry_->cameras.end()) {
    entry_->cameras.erase(mine);
  }
  if (--entry_->leases == 0) {
    registry().entries.remove_if([&](const Entry& entry) { return &entry == entry_; });
  }
}

const ReplayedFolder& FolderLease::open(std::int64_t memory_limit_mb) {
  const std::lock_guard lock(registry().mutex);
  const bool first = !entry_->loaded;
  ReplayedFolder fresh;
  if (first) {
    fresh.sequence = read_sequence(entry_->folder);
    fresh.views.resize(fresh.sequence.room.cameras.size());
    fresh.lap = lap_of(fresh.sequence);
  }
  ReplayedFolder& folder = first ? fresh : *entry_->loaded;
  for (std::size_t camera = 0; camera < folder.views.size(); ++camera) {
    const std::string& name = folder.sequence.room.cameras[camera].name;
    const bool wanted =
        std::find(entry_->cameras.begin(), entry_->cameras.end(), name) != entry_->cameras.end();
    if (wanted && !folder.views[camera].decoded) {
      decode(folder, camera, memory_limit_mb);
    }
  }
  if (first) {
    fresh.start = monotonic_now() + kTimeToGetReady;
    entry_->loaded = std::move(fresh);
  }
  return *entry_->loaded;
}

}  // namespace tubed
