#include "clients/cpp/writer_choice.hpp"

#include <algorithm>

namespace tubed {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::int64_t kMaxGap_ns = 100 * kMillisecond_ns;  // the deadline: three periods
constexpr std::int64_t kAlone_ns = 150 * kMillisecond_ns;
constexpr std::int64_t kMinProof_ns = 40 * kMillisecond_ns;
constexpr int kProofSamples = 3;
constexpr std::int64_t kForgotten_ns = 1'000 * kMillisecond_ns;

}  // namespace

Ruling WriterChoice::judge(const SampleOrigin& sample, std::int64_t now_ns) {
  forget_silent(now_ns);
  if (!followed_) {
    const Order order = SequenceGuard(max_rate_hz_).order_of(sample, now_ns);
    return order == Order::kFirst ? Ruling::kFirst : Ruling::kImplausible;
  }
  return is_of(*followed_, sample) ? judge_followed(sample, now_ns) : judge_other(sample, now_ns);
}

Ruling WriterChoice::judge_followed(const SampleOrigin& sample, std::int64_t now_ns) {
  const Order order = followed_->guard.order_of(sample, now_ns);
  if (order == Order::kBackward) return Ruling::kBackward;
  if (order == Order::kImplausible) {
    followed_->guard.refuse_jump(sample, now_ns);
    return Ruling::kImplausible;
  }
  // Also a sample that is too late to be delivered shows that its writer is alive.
  is_silent_ = false;
  for (Writer& other : others_) {
    other.alone_since_ns.reset();
    other.overlaps = other.overlaps || other.run > 0;
  }
  return Ruling::kNext;
}

Ruling WriterChoice::judge_other(const SampleOrigin& sample, std::int64_t now_ns) {
  Writer* const writer = other(sample, now_ns);
  if (writer == nullptr) return is_replay_of_ended(sample) ? Ruling::kBackward : Ruling::kRival;
  if (writer->is_gone) return Ruling::kRival;  // it waited in a queue
  const Order order = writer->guard.order_of(sample, now_ns);
  if (order == Order::kBackward) return Ruling::kBackward;
  if (order == Order::kImplausible) {
    writer->guard.refuse_jump(sample, now_ns);
    return Ruling::kImplausible;
  }
  hear(*writer, now_ns);
  if (takes_over(*writer, now_ns)) return Ruling::kOtherWriter;
  writer->guard.accept(sample, now_ns);
  return Ruling::kRival;
}

void WriterChoice::accept(const SampleOrigin& sample, Ruling ruling, std::int64_t now_ns) {
  if (ruling == Ruling::kFirst) {
    followed_ = Writer{sample.writer, sample.daemon_start, SequenceGuard(max_rate_hz_)};
  } else if (ruling == Ruling::kOtherWriter) {
    follow(sample);
  }
  lost_before_ = ruling == Ruling::kNext ? sample.sequence_number - followed_->guard.newest_number() - 1 : 0;
  followed_->guard.accept(sample, now_ns);
  followed_->heard_ns = now_ns;
  followed_->was_followed = true;
  is_silent_ = false;
}

/// Changes places: the writer followed so far is one of the others.
void WriterChoice::follow(const SampleOrigin& sample) {
  const auto chosen = std::find_if(others_.begin(), others_.end(),
                                   [&](const Writer& writer) { return is_of(writer, sample); });
  const Writer before = *followed_;
  followed_ = *chosen;
  followed_->overlaps = false;
  followed_->alone_since_ns.reset();
  others_.erase(chosen);
  for (Writer& writer : others_) writer.alone_since_ns.reset();
  others_.push_back(before);
  others_.back().run = 0;
}

void WriterChoice::match(std::span<const std::uint64_t> writers) {
  const auto look = [&](Writer& writer) {
    writer.is_gone = std::find(writers.begin(), writers.end(), writer.handle) == writers.end();
  };
  if (followed_) look(*followed_);
  std::for_each(others_.begin(), others_.end(), look);
}

std::optional<std::uint64_t> WriterChoice::rival(std::int64_t now_ns) const {
  for (const Writer& writer : others_) {
    if (writer.overlaps && !writer.is_gone && now_ns - writer.heard_ns < kForgotten_ns) return writer.handle;
  }
  return std::nullopt;
}

/// The writer of the sample among those that are not followed. A new one takes a free place; that of the same
/// handle, whose start a daemon does not change; or that of the one that proved least. Null for a replay, and
/// when those in its way have proved themselves.
WriterChoice::Writer* WriterChoice::other(const SampleOrigin& sample, std::int64_t now_ns) {
  const auto known = std::find_if(others_.begin(), others_.end(),
                                  [&](const Writer& writer) { return is_of(writer, sample); });
  if (known != others_.end()) return &*known;
  if (is_replay_of_ended(sample)) return nullptr;
  auto place = std::find_if(others_.begin(), others_.end(),
                            [&](const Writer& writer) { return writer.handle == sample.writer; });
  if (place == others_.end() && others_.size() == kMaxOthers) {
    place = std::min_element(others_.begin(), others_.end(),
                             [](const Writer& a, const Writer& b) { return a.run < b.run; });
  }
  if (place != others_.end()) {
    if (place->run >= kProofSamples) return nullptr;
    retire(*place);
    others_.erase(place);
  }
  others_.push_back({sample.writer, sample.daemon_start, SequenceGuard(max_rate_hz_)});
  others_.back().heard_ns = now_ns;
  return &others_.back();
}

void WriterChoice::forget_silent(std::int64_t now_ns) {
  std::erase_if(others_, [&](const Writer& writer) {
    const bool is_over = now_ns - writer.heard_ns >= kForgotten_ns;
    if (is_over) retire(writer);
    return is_over;
  });
}

void WriterChoice::hear(Writer& writer, std::int64_t now_ns) {
  if (writer.run == 0 || now_ns - writer.heard_ns > kMaxGap_ns) {
    writer.run = 0;
    writer.run_began_ns = now_ns;
    writer.alone_since_ns.reset();
  }
  ++writer.run;
  writer.heard_ns = now_ns;
  writer.alone_since_ns = writer.alone_since_ns.value_or(now_ns);
}

bool WriterChoice::takes_over(const Writer& writer, std::int64_t now_ns) const {
  const bool is_proved = writer.run >= kProofSamples && now_ns - writer.run_began_ns >= kMinProof_ns;
  const bool is_over =
      followed_->is_gone || is_silent_ || now_ns - writer.alone_since_ns.value_or(now_ns) >= kAlone_ns;
  return is_proved && is_over;
}

bool WriterChoice::is_replay_of_ended(const SampleOrigin& sample) const {
  return std::any_of(ended_.begin(), ended_.end(), [&](const Ended& ended) {
    return ended.daemon_start == sample.daemon_start && sample.sequence_number <= ended.newest_number;
  });
}

/// Remembers how far a start came that was followed. Of a start that two writers claim nothing is remembered:
/// a forger's number would lock the real writer out.
void WriterChoice::retire(const Writer& writer) {
  const auto claims_too = [&](const Writer& other) {
    return other.daemon_start == writer.daemon_start && other.handle != writer.handle;
  };
  const bool is_contested =
      (followed_ && claims_too(*followed_)) || std::any_of(others_.begin(), others_.end(), claims_too);
  if (!writer.was_followed || is_contested) return;
  if (ended_.size() == kMaxEnded) ended_.erase(ended_.begin());
  ended_.push_back({writer.daemon_start, writer.guard.newest_number()});
}

}  // namespace tubed
