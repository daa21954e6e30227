// What the fuzz targets share: a cursor over the input, and the check whose failure is a crash.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string_view>

namespace tubed::fuzz {

/// Ends the process when a promise is broken, so that libFuzzer keeps the input.
inline void demand(bool held) {
  if (!held) {
    std::abort();
  }
}

/// Reads values from the front of an input; zeros when it has ended.
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* bytes, std::size_t size) : rest_(bytes, size) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }

  template <typename Value>
  Value take() {
    Value value{};
    take_into(std::as_writable_bytes(std::span(&value, 1)));
    return value;
  }

  /// Fills as much of `room` as there is left.
  void take_into(std::span<std::byte> room) {
    const std::size_t count = std::min(room.size(), rest_.size());
    std::memcpy(room.data(), rest_.data(), count);
    rest_ = rest_.subspan(count);
  }

  std::span<const std::uint8_t> take_bytes(std::size_t most) {
    const auto bytes = rest_.first(std::min(most, rest_.size()));
    rest_ = rest_.subspan(bytes.size());
    return bytes;
  }

  std::string_view take_text(std::size_t most) {
    const auto bytes = take_bytes(most);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace tubed::fuzz
