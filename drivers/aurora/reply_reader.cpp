#include "drivers/aurora/reply_reader.hpp"

#include <algorithm>
#include <cstring>

namespace tubed::aurora {

namespace {

constexpr std::uint8_t kCarriageReturn = '\r';

bool is_character(std::uint8_t byte) noexcept {
  return (byte >= ' ' && byte <= '~') || byte == '\n' || byte == '\t';
}

}  // namespace

std::size_t ReplyReader::feed(Bytes chunk) noexcept {
  if (begin_ > 0) {
    std::memmove(bytes_.data(), bytes_.data() + begin_, waiting());
    end_ -= begin_;
    scanned_ -= begin_;
    begin_ = 0;
  }
  const std::size_t taken = std::min(chunk.size(), kCapacity - end_);
  std::copy_n(chunk.begin(), taken, bytes_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += taken;
  return taken;
}

std::optional<Reply> ReplyReader::next() noexcept {
  Reply reply;
  while (begin_ < end_) {
    switch (look(reply)) {
      case Step::kFound:
        ++counts_.replies;
        return reply;
      case Step::kNeedsMore:
        return std::nullopt;
      case Step::kGoOn:
        break;
    }
  }
  return std::nullopt;
}

void ReplyReader::give_up_waiting() noexcept {
  const bool frame = waiting() > 0 && bytes_[begin_] == kBxStartLow;
  discard(frame ? 1 : waiting());
}

void ReplyReader::clear() noexcept { discard(waiting()); }

ReplyReader::Step ReplyReader::look(Reply& reply) noexcept {
  return bytes_[begin_] == kBxStartLow ? look_at_frame(reply) : look_at_text(reply);
}

ReplyReader::Step ReplyReader::look_at_frame(Reply& reply) noexcept {
  Bytes body;
  switch (frame_bx(Bytes(bytes_).subspan(begin_, waiting()), body)) {
    case BxFrame::kComplete:
      reply = Reply{ReplyKind::kBinary, 0, body};
      take(kBxHeaderSize + body.size() + kBxCrcSize);
      return Step::kFound;
    case BxFrame::kNeedsMore:
      return Step::kNeedsMore;
    case BxFrame::kBadHeader:
      ++counts_.bad_headers;
      break;
    case BxFrame::kBadBody:
      ++counts_.bad_bodies;
      break;
    case BxFrame::kBadStart:
      break;
  }
  discard(1);
  return Step::kGoOn;
}

ReplyReader::Step ReplyReader::look_at_text(Reply& reply) noexcept {
  while (scanned_ < end_ && is_character(bytes_[scanned_])) {
    ++scanned_;
  }
  if (scanned_ == end_) {
    if (waiting() < kCapacity) {
      return Step::kNeedsMore;
    }
    ++counts_.overlong;
    discard(kCapacity);
    return Step::kGoOn;
  }
  if (bytes_[scanned_] == kCarriageReturn) {
    return take_line(scanned_, reply);
  }
  // No reply in characters has this byte; it may itself begin a frame.
  const bool may_begin_frame = bytes_[scanned_] == kBxStartLow;
  discard(scanned_ - begin_ + (may_begin_frame ? 0 : 1));
  return Step::kGoOn;
}

ReplyReader::Step ReplyReader::take_line(std::size_t end_of_line, Reply& reply) noexcept {
  const std::string_view line = as_text(Bytes(bytes_).subspan(begin_, end_of_line - begin_));
  const std::size_t size = line.size() + 1;
  if (const auto whole = decode_text_reply(line)) {
    reply = *whole;
    take(size);
    return Step::kFound;
  }
  counts_.bad_text += line.empty() ? 0 : 1;
  if (const auto word = decode_word_at_end(line)) {
    reply = *word;
    const std::size_t before = static_cast<std::size_t>(word->text().data() - line.data());
    discard(before);
    take(size - before);
    return Step::kFound;
  }
  discard(size);
  return Step::kGoOn;
}

void ReplyReader::discard(std::size_t count) noexcept {
  counts_.discarded_bytes += count;
  take(count);
}

void ReplyReader::take(std::size_t count) noexcept {
  begin_ += count;
  scanned_ = begin_;
}

}  // namespace tubed::aurora
