// A recording in a browser: the page of tubed-view with a time line.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "clients/evaluation/configured_sequence.hpp"
#include "clients/playback/played_shapes.hpp"
#include "clients/view/image_encoder.hpp"
#include "clients/view/web_server.hpp"

namespace tubed {

/// Shows a recording while it is reconstructed. All pages look at the same instant; each may change it. A
/// shape that is looked at is sent again several times a second, so that a page can tell a recording that
/// stands still from a program that does.
class Playback {
 public:
  /// Throws std::system_error when it cannot listen there, and as PlayedShapes. Precondition: the sequence
  /// has an instant.
  Playback(ConfiguredSequence run, WebServerSettings server);
  ~Playback();
  Playback(const Playback&) = delete;
  Playback& operator=(const Playback&) = delete;

  /// Until stop().
  void run() { server_.run(); }
  /// Any thread.
  void stop() { server_.stop(); }

  /// Any thread: instants that are made, of how many.
  [[nodiscard]] std::size_t ready() const { return shapes_.ready(); }
  [[nodiscard]] std::size_t total() const { return shapes_.instants().size(); }
  /// Any thread: see PlayedShapes.
  [[nodiscard]] std::string trouble() const { return shapes_.trouble(); }

 private:
  /// What a page was last sent, and when (s of the monotonic clock).
  struct Sent {
    std::optional<std::size_t> what;
    double at_s = -1;
  };
  /// One camera of the room.
  struct View {
    explicit View(const std::string& name) : encoder(name) {}
    ImageEncoder encoder;
    std::vector<std::size_t> rows;  ///< of frames.csv, in order of time
    RawImage image;                 ///< of `read`
    std::optional<std::size_t> read;
    Sent sent;
  };

  void hear(std::string_view words);
  void play();
  void follow_wishes(double now_s);
  void show_shapes(double now_s);
  void show_images(double now_s);
  void show_image(View& view, std::size_t row, double now_s);
  void show_time_line(double now_s);
  void show_position(double now_s);
  void show_room();
  void publish(MessageKind kind, std::string about, nlohmann::json words);

  ConfiguredSequence run_;
  std::string id_;  ///< of the instrument
  PlayedShapes shapes_;
  TimeLine line_;
  RecordingPosition position_;
  RoomFiles files_;
  std::deque<View> views_;
  PlayedInstant instant_{};
  Sent shape_sent_;
  Sent line_sent_;
  double position_sent_s_ = -1;
  std::uint64_t number_ = 0;
  std::mutex mutex_;                  ///< of the wishes
  std::vector<PlaybackWish> wishes_;  ///< that were not yet followed
  std::atomic<bool> must_end_{false};
  WebServer server_;
  std::thread thread_;
};

}  // namespace tubed
