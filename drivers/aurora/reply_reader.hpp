// Finds replies in the stream of bytes from an Aurora, however it is cut into pieces and whatever is between.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/bytes.hpp"
#include "drivers/aurora/reply.hpp"

namespace tubed::aurora {

/// One thread. Never allocates; holds kCapacity bytes and no more.
///
/// Use: feed() what came in, take next() until it is empty, again. A reply that is damaged costs itself: the
/// search goes on behind its first byte, so that the next reply is found even when it begins inside what the
/// damaged one claimed to be its body.
class ReplyReader {
 public:
  /// Longer than any reply; text that long without a carriage return is thrown away.
  static constexpr std::size_t kCapacity = 8192;
  static_assert(kCapacity > 2 * kMaxBxFrame);

  /// What was found and what was thrown away since the beginning.
  struct Counts {
    std::uint64_t replies = 0;
    std::uint64_t bad_text = 0;         ///< lines whose check sum is wrong
    std::uint64_t bad_headers = 0;      ///< start words whose header check sum or length is wrong
    std::uint64_t bad_bodies = 0;       ///< frames whose body check sum is wrong
    std::uint64_t overlong = 0;         ///< times that text filled everything
    std::uint64_t discarded_bytes = 0;  ///< bytes that belong to no reply
  };

  /// Takes as much of `chunk` as there is room for and says how much that was: all of it after next() came
  /// back empty, if `chunk` has no more than room() bytes. Ends what an earlier next() gave.
  std::size_t feed(Bytes chunk) noexcept;

  /// The next reply with right check sums, in the order in which they came; nothing when more bytes are
  /// needed. Its payload is good until the next call of feed(), next() or clear().
  [[nodiscard]] std::optional<Reply> next() noexcept;

  /// The deadline has come and what is waiting is still not whole: stop waiting for that. A reply that begins
  /// inside a frame whose rest never came is then found by next().
  void give_up_waiting() noexcept;

  /// Throws away what is waiting: before a command is sent, nothing of an earlier answer may stay.
  void clear() noexcept;

  /// Bytes that wait for the rest of a reply.
  [[nodiscard]] std::size_t waiting() const noexcept { return end_ - begin_; }
  /// Bytes that feed() takes now.
  [[nodiscard]] std::size_t room() const noexcept { return kCapacity - waiting(); }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  enum class Step { kFound, kNeedsMore, kGoOn };
  Step look(Reply& reply) noexcept;
  Step look_at_frame(Reply& reply) noexcept;
  Step look_at_text(Reply& reply) noexcept;
  Step take_line(std::size_t end_of_line, Reply& reply) noexcept;
  void discard(std::size_t count) noexcept;
  void take(std::size_t count) noexcept;

  std::array<std::uint8_t, kCapacity> bytes_{};
  std::size_t begin_ = 0;    // first byte not yet given out or thrown away
  std::size_t scanned_ = 0;  // from begin_ to here there is nothing but characters
  std::size_t end_ = 0;
  Counts counts_;
};

}  // namespace tubed::aurora
