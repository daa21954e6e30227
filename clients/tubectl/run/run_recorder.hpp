// Writes what sources give, as it comes, into a sequence folder.
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/replay/sequence_writer.hpp"

namespace tubed {

/// What threads hand over is written by a thread of its own, in the order of time: a source may be half a
/// second behind another one. Other threads encode pictures before, in any order, at low priority: a daemon
/// on the same host goes first. Pictures wait in memory while all are busy, up to kMaxWaiting_bytes. Each row
/// is handed to the system at once, so that whatever ends the process leaves a whole folder.
class RunRecorder {
 public:
  static constexpr std::size_t kMaxWaiting_bytes = std::size_t{2} << 30U;

  /// As SequenceWriter's constructor; time 0 of the folder is `begin`.
  RunRecorder(const std::filesystem::path& folder, const std::string& note, const RoomDescription& room,
              MonotonicTime begin, int encoders = usual_encoders());
  /// Half of the processors, 1 to 4.
  static int usual_encoders();
  /// Without finish() what waits is dropped.
  ~RunRecorder();
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  /// `t_s` of the measurement is set. What is older than `begin`, or was overtaken by more than half a
  /// second, is left out, as are pictures while too many wait, and all that comes after a failure. Both from
  /// any thread.
  void add(MonotonicTime measured, SequenceMeasurement measurement);
  void add(int camera, const ImageFrame& image);

  struct Counts {
    std::uint64_t measurements = 0;                   ///< written
    std::array<std::uint64_t, kMaxCameras> images{};  ///< of each camera, instants without radiation included
    std::uint64_t early = 0;                          ///< left out: older than the beginning
    std::uint64_t late = 0;                           ///< left out: they came too late
    std::uint64_t crowded_out = 0;                    ///< pictures left out: too many waited
    std::size_t waiting_bytes = 0;
    bool has_failed = false;
  };
  [[nodiscard]] Counts counts() const;

  /// Writes what waits. Throws SequenceError for whatever went wrong since the beginning; what was written
  /// before stays.
  void finish();

 private:
  struct Exposure {
    int camera = 0;
    bool fluoroscopy_on = false;
    GreyImage image;                ///< empty once it is encoded
    std::vector<std::uint8_t> png;  ///< what is written
    bool is_claimed = false;        ///< by an encoder
    bool is_ready = false;          ///< to be written
    std::optional<ViewGeometry> geometry;
    [[nodiscard]] std::size_t bytes() const { return image.pixels.size() + png.size(); }
  };
  using Item = std::variant<SequenceMeasurement, Exposure>;

  void add(MonotonicTime at, Item item, std::size_t bytes);
  void run();
  void encode();
  void join();
  [[nodiscard]] Exposure* next_to_encode();
  [[nodiscard]] bool is_due() const;
  void note_failure(const std::exception_ptr& failure);
  void write(MonotonicTime at, const Item& item);

  SequenceWriter writer_;
  MonotonicTime begin_;
  std::uint32_t next_frame_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable news_;  ///< of the thread that writes
  std::multimap<MonotonicTime, Item> waiting_;
  MonotonicTime newest_{};
  MonotonicTime written_until_{};
  Counts counts_;
  std::exception_ptr failure_;
  bool is_over_ = false;
  bool is_dropped_ = false;
  std::condition_variable encoders_news_;
  std::vector<std::thread> encoders_;
  std::thread thread_;
};

}  // namespace tubed
