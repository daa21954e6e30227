// Bounds how many instruments one subscriber remembers: a program that publishes under invented ids must not
// fill the memory of a client.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "idl/printable_text.hpp"

namespace tubed {

/// How long an instrument that is not heard keeps its place.
struct GateTimeouts {
  std::chrono::milliseconds unknown{200};  ///< until it has sent ten samples
  std::chrono::milliseconds known{10'000};
};

/// Admits the instrument asked for, or as many as allowed. When there are too many, one that was not heard
/// for a while makes room; an instrument that sent ten samples is given more time, so that invented ids do
/// not push out real ones. Any thread; admits() is called by Cyclone's receiving thread before it stores a
/// sample.
class InstrumentGate {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `wanted` empty: every instrument, `max_instruments` at a time.
  InstrumentGate(std::string wanted, std::size_t max_instruments, GateTimeouts timeouts = {})
      : wanted_(std::move(wanted)),
        max_instruments_(std::max<std::size_t>(max_instruments, 1)),
        timeouts_(timeouts) {}

  /// Whether a sample of this instrument that comes at `now` is stored.
  bool admits(std::string_view id, Time now) {
    if (!wanted_.empty()) return id == wanted_;
    const std::scoped_lock lock(mutex_);
    const auto known =
        std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.id == id; });
    if (known != entries_.end()) {
      known->heard = now;
      ++known->samples;
      return true;
    }
    if (entries_.size() < max_instruments_) {
      entries_.push_back({std::string(id), now, 1});
      return true;
    }
    const auto silent = std::find_if(entries_.begin(), entries_.end(),
                                     [&](const Entry& e) { return now - e.heard > timeout(e); });
    if (silent == entries_.end()) {
      ++refused_;
      return false;
    }
    *silent = {std::string(id), now, 1};
    ++replaced_;
    return true;
  }

  /// Whether the instrument still has its place.
  [[nodiscard]] bool has(std::string_view id) const {
    const std::scoped_lock lock(mutex_);
    return !wanted_.empty() ||
           std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.id == id; });
  }

  /// How often an instrument made room for another one.
  [[nodiscard]] std::uint64_t replaced() const {
    const std::scoped_lock lock(mutex_);
    return replaced_;
  }

  /// Samples of instruments for which there was no room.
  [[nodiscard]] std::uint64_t refused() const {
    const std::scoped_lock lock(mutex_);
    return refused_;
  }

 private:
  struct Entry {
    std::string id;
    Time heard;
    std::uint64_t samples;
  };

  [[nodiscard]] std::chrono::milliseconds timeout(const Entry& entry) const {
    constexpr std::uint64_t kKnownSamples = 10;
    return entry.samples < kKnownSamples ? timeouts_.unknown : timeouts_.known;
  }

  std::string wanted_;
  std::size_t max_instruments_;
  GateTimeouts timeouts_;
  mutable std::mutex mutex_;
  std::vector<Entry> entries_;
  std::uint64_t replaced_ = 0;
  std::uint64_t refused_ = 0;
};

/// Of a reader's SampleFilter: `gate` is the InstrumentGate. Instruments are known by their ids as they may
/// be shown.
template <typename Sample>
bool is_admitted(const void* sample, void* gate) {
  std::array<char, sizeof(Sample::instrument_id)> id{};
  copy_printable(static_cast<const Sample*>(sample)->instrument_id, id);
  return static_cast<InstrumentGate*>(gate)->admits(id.data(), std::chrono::steady_clock::now());
}

}  // namespace tubed
