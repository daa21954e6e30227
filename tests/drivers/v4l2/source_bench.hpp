// A source at a fake card, run as the image grab thread runs it.
#pragma once

#include <string>
#include <vector>

#include "drivers/v4l2/v4l2_image_source.hpp"
#include "tests/drivers/v4l2/fake_card.hpp"

namespace tubed {

struct SourceBench {
  FakeCard card;
  CameraCalibration camera{.name = "A", .width = 96, .height = 64};
  V4l2Settings settings = [] {
    V4l2Settings usual;
    usual.request.path = "/dev/video0";
    return usual;
  }();
  std::unique_ptr<V4l2ImageSource> source{};
  ImageFrame frame{};
  std::vector<ImageFrame> frames{};
  std::vector<std::string> said{};  ///< words, each time that they changed

  void open() {
    frame.reserve(camera.width, camera.height);
    source = std::make_unique<V4l2ImageSource>(camera, settings, std::make_unique<FakeVideoDevice>(card));
    ASSERT_TRUE(source->open().ok);
  }
  void run_for(std::chrono::nanoseconds time) {
    const MonotonicTime end = card.time + time;
    while (card.time < end) {
      ReadOutcome outcome = ReadOutcome::kRefused;
      while (outcome == ReadOutcome::kFrame || outcome == ReadOutcome::kRefused) {
        outcome = source->read(frame);
        ASSERT_NE(outcome, ReadOutcome::kLost);
        note_words();
        if (outcome == ReadOutcome::kFrame) {
          frames.push_back(frame);
        }
      }
      source->wait(std::min(end, card.time + std::chrono::milliseconds(50)));
    }
  }
  void note_words() {
    const std::string words(source->condition().words.text());
    if (said.empty() ? !words.empty() : words != said.back()) {
      said.push_back(words);
    }
  }
  /// The time until the words contain `text`, within 5 s.
  std::chrono::nanoseconds time_until_said(const std::string& text) {
    const MonotonicTime from = card.time;
    while (card.time < from + std::chrono::seconds(5)) {
      source->read(frame);
      if (source->condition().words.text().find(text) != std::string_view::npos) {
        return card.time - from;
      }
      source->wait(card.time + std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << "never said: " << text << "; it says: " << source->condition().words.text();
    return std::chrono::seconds(5);
  }
  [[nodiscard]] DeviceState state() const { return source->condition().state; }
  [[nodiscard]] std::string words() const { return std::string(source->condition().words.text()); }
};

}  // namespace tubed
