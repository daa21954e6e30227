#include "clients/playback/playback_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

namespace tubed {

namespace {

using nlohmann::json;

constexpr int kMaxStep = 1'000'000;
constexpr int kMaxDoublings = 8;

json rounded(float value) {
  return std::isfinite(value) ? json(std::round(double{value} * 100) / 100) : json();
}

/// The largest of a piece, piece by piece.
class LargestOfPieces {
 public:
  explicit LargestOfPieces(std::size_t pieces) : values_(pieces, std::numeric_limits<float>::quiet_NaN()) {}
  void add(std::size_t piece, float value) {
    if (std::isfinite(value) && !(values_[piece] >= value)) values_[piece] = value;
  }
  [[nodiscard]] bool is_empty() const {
    return std::none_of(values_.begin(), values_.end(), [](float value) { return std::isfinite(value); });
  }
  [[nodiscard]] json values() const {
    json values = json::array();
    for (const float value : values_) values.push_back(rounded(value));
    return values;
  }

 private:
  std::vector<float> values_;
};

struct Row {
  const char* name;
  float InstantSummary::*value;
};
constexpr std::array<Row, 3> kRows{{{"error in view, RMS", &InstantSummary::error_mm},
                                    {"largest residual of a coil", &InstantSummary::residual_mm},
                                    {"largest sigma", &InstantSummary::sigma_mm}}};

/// From the most valid to the least.
constexpr std::string_view kLetters = " VQIN";

char letter_of(Validity validity) {
  switch (validity) {
    case Validity::kValid:
      return 'V';
    case Validity::kQuestionable:
      return 'Q';
    case Validity::kInvalid:
      return 'I';
    case Validity::kNotAvailable:
      return 'N';
  }
  return 'N';
}

/// Which piece holds which instant.
class Pieces {
 public:
  Pieces(const TimeLine& line, std::size_t count)
      : line_(line), count_(count), span_s_(std::max(line.times_s.back() - line.times_s.front(), 1e-9)) {}
  [[nodiscard]] std::size_t of(std::size_t instant) const {
    const double share = (line_.times_s[instant] - line_.times_s.front()) / span_s_;
    return std::min(static_cast<std::size_t>(share * static_cast<double>(count_)), count_ - 1);
  }

 private:
  const TimeLine& line_;
  std::size_t count_;
  double span_s_;
};

}  // namespace

std::optional<PlaybackWish> parse_wish(std::string_view words) {
  const json wish = json::parse(words, nullptr, false);
  if (!wish.is_object() || wish.size() != 1) return std::nullopt;
  const std::string& name = wish.begin().key();
  const json& value = wish.begin().value();
  if (name == "play" && value.is_boolean()) return PlaybackWish{.play = value.get<bool>()};
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  if (name == "seek") return PlaybackWish{.seek_s = number};
  if (name == "step" && std::abs(number) <= kMaxStep) return PlaybackWish{.step = static_cast<int>(number)};
  if (name == "faster" && std::abs(number) <= kMaxDoublings)
    return PlaybackWish{.faster = static_cast<int>(number)};
  return std::nullopt;
}

void follow(const PlaybackWish& wish, double now_s, RecordingPosition& position) {
  if (wish.play) *wish.play ? position.play(now_s) : position.pause(now_s);
  if (wish.seek_s) position.seek(*wish.seek_s, now_s);
  if (wish.step) position.step(*wish.step, now_s);
  if (wish.faster) position.set_speed(std::ldexp(position.speed(), *wish.faster), now_s);
}

json timeline_json(const TimeLine& line, std::size_t pieces) {
  const std::size_t ready = std::min(line.instants.size(), line.times_s.size());
  const Pieces piece(line, pieces);
  std::string validity(pieces, ' ');
  std::array<LargestOfPieces, kRows.size()> rows{LargestOfPieces(pieces), LargestOfPieces(pieces),
                                                 LargestOfPieces(pieces)};
  for (std::size_t i = 0; i < ready; ++i) {
    const std::size_t at = piece.of(i);
    const char letter = letter_of(line.instants[i].validity);
    if (kLetters.find(letter) > kLetters.find(validity[at])) validity[at] = letter;
    for (std::size_t row = 0; row < kRows.size(); ++row)
      rows[row].add(at, line.instants[i].*kRows[row].value);
  }
  json object{{"type", "timeline"},
              {"name", line.name},
              {"begin", line.times_s.front()},
              {"end", line.times_s.back()},
              {"ready", ready == 0 ? line.times_s.front() : line.times_s[ready - 1]},
              {"done", ready == line.times_s.size()},
              {"trouble", line.trouble},
              {"validity", validity},
              {"rows", json::array()}};
  for (std::size_t row = 0; row < kRows.size(); ++row) {
    if (rows[row].is_empty()) continue;
    object["rows"].push_back({{"name", kRows[row].name}, {"unit", "mm"}, {"values", rows[row].values()}});
  }
  return object;
}

json position_json(const RecordingPosition& position, std::uint32_t frame) {
  json object{{"type", "position"},
              {"at", std::round(position.t_s() * 1e4) / 1e4},
              {"instant", nullptr},
              {"frame", frame},
              {"playing", position.is_playing()},
              {"speed", position.speed()}};
  if (const auto instant = position.instant()) object["instant"] = *instant;
  return object;
}

}  // namespace tubed
