#include "daemon/pipeline/view_stage.hpp"

#include <array>
#include <cstdio>
#include <cstring>
#include <span>

namespace tubed {

namespace {

const char* words_of(UnjudgedView why) {
  switch (why) {
    case UnjudgedView::kLearning:
      return "learning the view: a sudden move is noticed, a slow one not yet";
    case UnjudgedView::kFewBlocks:
      return "the view is not judged: too little of the picture is open";
    case UnjudgedView::kNoBackground:
      return "the view is not judged: no background comes back (a bench without a patient)";
    case UnjudgedView::kNone:
    case UnjudgedView::kBladesMove:
      return "";
  }
  return "";
}

std::size_t bytes_of(const ImageFrame& frame) {
  const std::size_t depth = frame.depth == PixelDepth::kGrey16 ? 2 : 1;
  return static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) * depth;
}

/// What kind of move it was, and about how much.
void write_move(const BackgroundMotion& motion, std::span<char> text) {
  switch (motion.kind) {
    case BackgroundMotion::Kind::kPanned:
      std::snprintf(text.data(), text.size(), "table or C-arm went by about %.0f mm", motion.shift_mm.norm());
      return;
    case BackgroundMotion::Kind::kMagnified:
      std::snprintf(text.data(), text.size(), "the magnification is %.2f of what it was",
                    motion.magnification);
      return;
    case BackgroundMotion::Kind::kTurned:
      std::snprintf(text.data(), text.size(),
                    "near and far parts went differently: the C-arm turned, or the patient");
      return;
    case BackgroundMotion::Kind::kUnknown:
      std::snprintf(text.data(), text.size(), "too far to say how");
      return;
  }
}

}  // namespace

void ViewInlet::offer(const ImageFrame& frame) const noexcept {
  if (frames == nullptr || !frame.fluoroscopy_on) {
    return;
  }
  ImageFrame& copy = frames->back();
  const std::size_t bytes = bytes_of(frame);
  if (frame.width != copy.width || frame.height != copy.height || bytes > copy.pixels.size() ||
      bytes > frame.pixels.size()) {
    return;
  }
  copy.exposure = frame.exposure;
  copy.frame_number = frame.frame_number;
  copy.fluoroscopy_on = true;
  copy.depth = frame.depth;
  copy.geometry = frame.geometry;
  std::memcpy(copy.pixels.data(), frame.pixels.data(), bytes);
  frames->publish();
  bell->ring();
}

bool ViewStage::step(const Clock& /*clock*/) noexcept {
  if (!from_grab_.fetch()) {
    return false;
  }
  const ImageFrame& frame = from_grab_.front();
  const ViewGeometry* const geometry = geometry_of_newest();
  if (geometry == nullptr) {
    return false;
  }
  watch_.look_from(*geometry, frame.exposure);
  const ViewVerdict& verdict = watch_.observe(frame);
  if (verdict.why != UnjudgedView::kBladesMove) {
    told_ = verdict.why;
  }
  to_optimizer_.back() = verdict;
  superseded_ += to_optimizer_.publish() ? 1 : 0;
  ++outputs_;
  return true;
}

/// nullptr when the image is going to be refused for what it brings.
const ViewGeometry* ViewStage::geometry_of_newest() noexcept {
  if (configured_ != nullptr && configured_->fetch()) {
    geometry_ = configured_->front();
    camera_.look_from(geometry_);
  }
  const std::optional<ViewGeometry>& own = from_grab_.front().geometry;
  if (camera_.geometry == GeometryUse::kConfiguration || (!own && camera_.geometry == GeometryUse::kImage)) {
    return &geometry_;
  }
  return own && refusal_of(*own, camera_) == nullptr ? &*own : nullptr;
}

void ViewStage::describe(StageReport& report) const noexcept {
  const ViewVerdict& verdict = watch_.newest();
  report.outputs = outputs_;
  report.dropped = superseded_;
  report.state = outputs_ == 0 ? StageState::kStarting : StageState::kRunning;
  if (verdict.state == ViewState::kMoved) {
    std::array<char, 96> move{};
    write_move(verdict.motion, move);
    report.state = StageState::kDegraded;
    std::snprintf(
        report.why.data(), report.why.size(),
        "the view has moved (%s) and no new pose was given: its images are left out until it is found again; "
        "move it back, or give the new T_camera_world",
        move.data());
    return;
  }
  if (verdict.state == ViewState::kSuspect) {
    report.state = StageState::kDegraded;
    std::snprintf(
        report.why.data(), report.why.size(),
        "the view may have moved: its images are not used meanwhile (%.0f %% of the background is where it "
        "was, %.0f %% where the image before had it)",
        100 * verdict.still_share, 100 * verdict.jump_share);
    return;
  }
  std::snprintf(report.why.data(), report.why.size(), "%s", outputs_ == 0 ? "" : words_of(told_));
}

}  // namespace tubed
