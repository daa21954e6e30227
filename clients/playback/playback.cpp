#include "clients/playback/playback.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>

#include "clients/view/messages.hpp"
#include "daemon/config/published_room.hpp"
#include "daemon/publishing/wire_conversion.hpp"
#include "drivers/interface/view_in_shm.hpp"
#include "drivers/replay/sequence_image.hpp"

namespace tubed {

namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kStep{10};
constexpr double kShapeAgain_s = 0.1;   // below the silence from which on a page shows no shape
constexpr double kImageAgain_s = 0.25;  // below that from which on a page calls an image old
constexpr double kMinImagePeriod_s = 1.0 / 15;
constexpr double kPositionAgain_s = 0.5;
constexpr double kTimeLineAgain_s = 0.5;
constexpr std::size_t kPieces = 900;  // of the time line: about a pixel each
constexpr std::size_t kMaxWishes = 64;
constexpr std::size_t kTruthStep = 4;  // every so many-th true point, which are 1 mm apart

std::int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::vector<double> times_of(const std::vector<SequenceInstant>& instants) {
  std::vector<double> times_s;
  for (const SequenceInstant& instant : instants) times_s.push_back(instant.t_s);
  return times_s;
}

/// 3 numbers a point, mm, tip first; null without truth.
json truth_json(const SequenceTruth* truth) {
  if (truth == nullptr) return {};
  json points = json::array();
  for (Eigen::Index i = 0; i < truth->points_world_mm.cols(); i += kTruthStep) {
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back(std::round(truth->points_world_mm(axis, i) * 100) / 100);
    }
  }
  return points;
}

/// As a frame grabber would have written it.
RawImage raw_image_of(const Sequence& sequence, const SequenceFrame& row) {
  RawImage raw;
  const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(row.camera)];
  raw.head.exposure_ns = to_ns(sequence_time(row.t_s));
  raw.head.frame_number = row.frame;
  raw.head.origin = TUBED_SHM_REPLAYED;
  raw.head.width = static_cast<std::uint32_t>(camera.width);
  raw.head.height = static_cast<std::uint32_t>(camera.height);
  raw.head.depth_bits = 8;
  if (row.geometry) write_geometry(*row.geometry, raw.head);
  if (!row.fluoroscopy_on()) return raw;
  GreyImage image = read_image(sequence, row);
  raw.head.fluoroscopy_on = 1;
  raw.head.depth_bits = image.depth == PixelDepth::kGrey8 ? 8 : 16;
  raw.pixels = std::move(image.pixels);
  return raw;
}

}  // namespace

Playback::Playback(ConfiguredSequence run, WebServerSettings server)
    : run_(std::move(run)),
      id_(run_.sequence.room.instruments.front().id),
      shapes_(run_),
      position_(times_of(shapes_.instants())),
      files_(server.files),
      server_(std::move(server), [this](std::string_view words) { hear(words); }) {
  line_.name = std::filesystem::absolute(run_.sequence.folder).lexically_normal().filename().string();
  line_.times_s = times_of(shapes_.instants());
  for (const CameraCalibration& camera : run_.sequence.room.cameras) views_.emplace_back(camera.name);
  for (std::size_t row = 0; row < run_.sequence.frames.size(); ++row) {
    views_[static_cast<std::size_t>(run_.sequence.frames[row].camera)].rows.push_back(row);
  }
  thread_ = std::thread([this] { play(); });
}

Playback::~Playback() {
  must_end_ = true;
  thread_.join();
}

void Playback::hear(std::string_view words) {
  const std::optional<PlaybackWish> wish = parse_wish(words);
  const std::lock_guard lock(mutex_);
  if (wish && wishes_.size() < kMaxWishes) wishes_.push_back(*wish);
}

void Playback::play() {
  show_room();
  while (!must_end_) {
    const double now_s = static_cast<double>(monotonic_ns()) * 1e-9;
    position_.set_ready(shapes_.ready());
    follow_wishes(now_s);
    position_.advance(now_s);
    show_time_line(now_s);
    if (server_.tabs() > 0) {
      show_shapes(now_s);
      show_images(now_s);
      show_position(now_s);
    }
    std::this_thread::sleep_for(kStep);
  }
}

void Playback::follow_wishes(double now_s) {
  std::vector<PlaybackWish> wishes;
  {
    const std::lock_guard lock(mutex_);
    wishes.swap(wishes_);
  }
  for (const PlaybackWish& wish : wishes) follow(wish, now_s, position_);
  if (!wishes.empty()) position_sent_s_ = -1;
}

void Playback::show_shapes(double now_s) {
  const std::optional<std::size_t> instant = position_.instant();
  if (!instant) return;
  const bool is_other = instant != shape_sent_.what;
  if (!is_other && now_s - shape_sent_.at_s < kShapeAgain_s) return;
  if (is_other) shapes_.read(*instant, instant_);
  shape_sent_ = {instant, now_s};
  std::array<double, 16> T_world_em{};
  const Eigen::Matrix4d& T = run_.sequence.room.T_world_em.matrix();
  for (std::size_t i = 0; i < T_world_em.size(); ++i)
    T_world_em[i] = T(static_cast<int>(i) / 4, static_cast<int>(i) % 4);
  const tubed_EmSamples* const coils = instant_.coils.coil_count > 0 ? &instant_.coils : nullptr;
  json fused = estimate_json(instant_.fused, monotonic_ns(), coils, T_world_em.data());
  fused["truth"] = truth_json(find_truth(run_.sequence, shapes_.instants()[*instant].frame));
  publish(MessageKind::kEstimate, id_, std::move(fused));
  if (run_.estimator.mode == EstimatorMode::kEm) return;
  publish(MessageKind::kEstimate, id_ + "-em",
          estimate_json(instant_.coils_only, monotonic_ns(), coils, T_world_em.data()));
}

void Playback::show_images(double now_s) {
  const std::optional<std::size_t> instant = position_.instant();
  if (!instant) return;
  const double until_s = shapes_.instants()[*instant].t_s;
  for (View& view : views_) {
    const auto later =
        std::upper_bound(view.rows.begin(), view.rows.end(), until_s,
                         [this](double t_s, std::size_t row) { return t_s < run_.sequence.frames[row].t_s; });
    if (later != view.rows.begin()) show_image(view, *std::prev(later), now_s);
  }
}

void Playback::show_image(View& view, std::size_t row, double now_s) {
  const bool is_other = row != view.sent.what;
  if (now_s - view.sent.at_s < (is_other ? kMinImagePeriod_s : kImageAgain_s)) return;
  view.sent = {row, now_s};
  if (row != view.read) {
    view.read = row;
    try {
      view.image = raw_image_of(run_.sequence, run_.sequence.frames[row]);
    } catch (const SequenceError& error) {
      std::cerr << '\n' << error.what() << '\n';
      view.image.pixels.clear();  // the page says that there is no image
      view.image.head.fluoroscopy_on = 0;
    }
  }
  server_.publish(view.encoder.encode(view.image, ++number_, monotonic_ns()));
}

void Playback::show_time_line(double now_s) {
  const std::size_t ready = shapes_.ready();
  std::string trouble = shapes_.trouble();
  const bool is_due = line_sent_.what != ready && now_s - line_sent_.at_s >= kTimeLineAgain_s;
  if (!is_due && trouble == line_.trouble) return;
  line_.trouble = std::move(trouble);
  line_sent_ = {ready, now_s};
  shapes_.add_summaries(line_.instants);
  publish(MessageKind::kRoom, "timeline", timeline_json(line_, kPieces));
}

void Playback::show_position(double now_s) {
  const double again_s = position_.is_playing() ? kShapeAgain_s : kPositionAgain_s;
  if (now_s - position_sent_s_ < again_s) return;
  position_sent_s_ = now_s;
  const std::optional<std::size_t> instant = position_.instant();
  publish(MessageKind::kRoom, "position",
          position_json(position_, instant ? shapes_.instants()[*instant].frame : 0));
}

void Playback::show_room() {
  RoomKnowledge known;
  known.files = files_;
  const RoomDescription& room = run_.sequence.room;
  InstrumentDescription instrument = room.instruments.front();
  to_wire(identity_of(room, instrument, run_.estimator.mode), known.identities[id_]);
  if (run_.estimator.mode != EstimatorMode::kEm) {
    instrument.id += "-em";
    to_wire(identity_of(room, instrument, EstimatorMode::kEm), known.identities[instrument.id]);
  }
  for (const CameraCalibration& camera : room.cameras) known.image_cameras.push_back(camera.name);
  publish(MessageKind::kRoom, "room", room_json(known));
}

void Playback::publish(MessageKind kind, std::string about, json words) {
  auto message = std::make_shared<Message>();
  message->kind = kind;
  message->about = std::move(about);
  message->number = ++number_;
  words["n"] = message->number;
  message->payload = words.dump(-1, ' ', false, json::error_handler_t::replace);
  server_.publish(std::move(message));
}

}  // namespace tubed
