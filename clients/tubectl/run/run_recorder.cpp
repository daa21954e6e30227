#include "clients/tubectl/run/run_recorder.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kMaxBehind{500};

}  // namespace

int RunRecorder::usual_encoders() {
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 4);
}

RunRecorder::RunRecorder(const std::filesystem::path& folder, const std::string& note,
                         const RoomDescription& room, MonotonicTime begin, int encoders)
    : writer_(folder, note, room), begin_(begin), written_until_(begin), thread_([this] { run(); }) {
  for (int i = 0; i < encoders; ++i) encoders_.emplace_back([this] { encode(); });
}

RunRecorder::~RunRecorder() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = is_dropped_ = true;
  }
  join();
}

void RunRecorder::join() {
  news_.notify_all();
  encoders_news_.notify_all();
  if (thread_.joinable()) thread_.join();
  for (std::thread& encoder : encoders_) {
    if (encoder.joinable()) encoder.join();
  }
}

void RunRecorder::add(MonotonicTime measured, SequenceMeasurement measurement) {
  measurement.t_s = seconds_between(begin_, measured);
  add(measured, Item(measurement), 0);
}

void RunRecorder::add(int camera, const ImageFrame& image) {
  Exposure exposure;
  exposure.camera = camera;
  exposure.fluoroscopy_on = image.fluoroscopy_on;
  exposure.is_ready = !image.fluoroscopy_on;
  exposure.geometry = image.geometry;
  if (image.fluoroscopy_on) {
    const std::size_t bytes = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                              (image.depth == PixelDepth::kGrey16 ? 2 : 1);
    exposure.image = {image.width, image.height, image.depth, {}};
    exposure.image.pixels.assign(image.pixels.begin(),
                                 image.pixels.begin() + static_cast<std::ptrdiff_t>(bytes));
  }
  const std::size_t bytes = exposure.bytes();
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
  (bytes > 0 ? encoders_news_ : news_).notify_one();
}

/// The oldest one that nobody has begun with; nullptr: there is none.
RunRecorder::Exposure* RunRecorder::next_to_encode() {
  for (auto& [at, item] : waiting_) {
    auto* const exposure = std::get_if<Exposure>(&item);
    if (exposure != nullptr && !exposure->is_ready && !exposure->is_claimed) return exposure;
  }
  return nullptr;
}

void RunRecorder::encode() {
  constexpr int kNice = 10;
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // of this thread alone; it may fail
  std::unique_lock lock(mutex_);
  while (true) {
    Exposure* exposure = nullptr;
    encoders_news_.wait(lock, [&] {
      exposure = next_to_encode();
      return exposure != nullptr || is_over_;
    });
    if (exposure == nullptr || is_dropped_ || failure_) return;
    exposure->is_claimed = true;  // it is not written before it is ready, so that it stays where it is
    lock.unlock();
    std::exception_ptr failure;
    std::vector<std::uint8_t> png;
    try {
      png = encode_image(exposure->image);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    const std::size_t before = exposure->bytes();
    exposure->png = std::move(png);
    exposure->image.pixels = {};
    exposure->is_ready = true;
    counts_.waiting_bytes = counts_.waiting_bytes + exposure->bytes() - before;
    if (failure) note_failure(failure);
    news_.notify_one();
  }
}

void RunRecorder::note_failure(const std::exception_ptr& failure) {
  if (!failure_) failure_ = failure;
  counts_.has_failed = true;
}

bool RunRecorder::is_due() const {
  if (waiting_.empty()) return false;
  const auto* const exposure = std::get_if<Exposure>(&waiting_.begin()->second);
  if (exposure != nullptr && !exposure->is_ready) return false;
  return is_over_ || newest_ - waiting_.begin()->first > kMaxBehind;
}

void RunRecorder::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    news_.wait(lock, [this] {
      return is_due() || is_dropped_ || failure_ != nullptr || (is_over_ && waiting_.empty());
    });
    if (!is_due() || is_dropped_ || failure_) return;
    auto first = waiting_.extract(waiting_.begin());
    written_until_ = first.key();
    lock.unlock();
    std::exception_ptr failure;
    try {
      write(first.key(), first.mapped());
      writer_.flush();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (const auto* const exposure = std::get_if<Exposure>(&first.mapped())) {
      counts_.waiting_bytes -= exposure->bytes();
      counts_.images.at(static_cast<std::size_t>(exposure->camera)) += failure ? 0 : 1;
    } else {
      counts_.measurements += failure ? 0 : 1;
    }
    if (failure) {
      note_failure(failure);
      encoders_news_.notify_all();
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
    writer_.add_encoded_exposure(frame, t_s, exposure.camera, exposure.png);
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
  join();
  if (failure_) std::rethrow_exception(failure_);
  writer_.finish();
}

}  // namespace tubed
