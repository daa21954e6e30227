#include "clients/tubectl/run/run_recorder.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kMaxBehind{500};

std::size_t bytes_of(const GreyImage& image) { return image.pixels.size(); }

}  // namespace

RunRecorder::RunRecorder(const std::filesystem::path& folder, const std::string& note,
                         const RoomDescription& room, MonotonicTime begin)
    : writer_(folder, note, room), begin_(begin), written_until_(begin), thread_([this] { run(); }) {}

RunRecorder::~RunRecorder() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = is_dropped_ = true;
  }
  news_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RunRecorder::add(MonotonicTime measured, SequenceMeasurement measurement) {
  measurement.t_s = seconds_between(begin_, measured);
  add(measured, Item(measurement), 0);
}

void RunRecorder::add(int camera, const ImageFrame& image) {
  Exposure exposure{camera, image.fluoroscopy_on, {}, image.geometry};
  if (image.fluoroscopy_on) {
    const std::size_t bytes = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                              (image.depth == PixelDepth::kGrey16 ? 2 : 1);
    exposure.image = {image.width, image.height, image.depth, {}};
    exposure.image.pixels.assign(image.pixels.begin(),
                                 image.pixels.begin() + static_cast<std::ptrdiff_t>(bytes));
  }
  const std::size_t bytes = bytes_of(exposure.image);
  add(image.exposure, Item(std::move(exposure)), bytes);
}

void RunRecorder::add(MonotonicTime at, Item item, std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (is_over_ || failure_) return;
    const bool is_early = at < begin_;
    const bool is_late = at < written_until_;
    const bool is_crowded = bytes > 0 && counts_.waiting_bytes + bytes > kMaxWaiting_bytes;
    if (is_early || is_late || is_crowded) {
      ++(is_early ? counts_.early : is_late ? counts_.late : counts_.crowded_out);
      return;
    }
    counts_.waiting_bytes += bytes;
    newest_ = std::max(newest_, at);
    waiting_.emplace(at, std::move(item));
  }
  news_.notify_one();
}

void RunRecorder::run() {
  std::unique_lock lock(mutex_);
  const auto is_due = [this] {
    return !waiting_.empty() && (is_over_ || newest_ - waiting_.begin()->first > kMaxBehind);
  };
  while (true) {
    news_.wait(lock, [&] { return is_due() || is_over_; });
    if (is_dropped_ || failure_ || (is_over_ && waiting_.empty())) return;
    auto first = waiting_.extract(waiting_.begin());
    written_until_ = first.key();
    lock.unlock();
    std::exception_ptr failure;
    try {
      write(first.key(), first.mapped());
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (const auto* const exposure = std::get_if<Exposure>(&first.mapped())) {
      counts_.waiting_bytes -= bytes_of(exposure->image);
      ++counts_.images.at(static_cast<std::size_t>(exposure->camera));
    } else {
      ++counts_.measurements;
    }
    if (failure) {
      failure_ = failure;
      counts_.has_failed = true;
    }
  }
}

void RunRecorder::write(MonotonicTime at, const Item& item) {
  if (const auto* const measurement = std::get_if<SequenceMeasurement>(&item)) {
    writer_.add_measurement(*measurement);
    return;
  }
  const auto& exposure = std::get<Exposure>(item);
  const std::uint32_t frame = next_frame_++;
  const double t_s = seconds_between(begin_, at);
  if (!exposure.fluoroscopy_on) {
    writer_.add_instant_without_fluoroscopy(frame, t_s, exposure.camera);
  } else {
    writer_.add_exposure(frame, t_s, exposure.camera, exposure.image);
  }
  if (exposure.geometry) writer_.add_geometry(frame, *exposure.geometry);
}

RunRecorder::Counts RunRecorder::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void RunRecorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  news_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (failure_) std::rethrow_exception(failure_);
  writer_.finish();
}

}  // namespace tubed
