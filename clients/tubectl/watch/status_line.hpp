// What `tubectl status` says of one instrument. Pure: time comes with the samples.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "TubeStatus.h"
#include "clients/cpp/tube_subscriber.hpp"

namespace tubed {

/// "starting", "running", ... of StageStatus.state; "unknown" beyond.
std::string_view name_of_stage_state(std::uint32_t state);

/// Of one instrument.
class StatusLine {
 public:
  void add(const TubeSample& sample);
  void add(const TubeNews& event);
  /// False when the stages were known already; they are replaced.
  bool add(const tubed_TubeStatus& status);

  /// The newest thing heard is an estimate, it is VALID, and nobody else publishes the instrument.
  [[nodiscard]] bool is_valid() const;

  /// `ID WORD reasons rate=30.0Hz latency=12ms age=9ms em=running grab-A=running ...`, no line break. After
  /// an event the word is NO_SHAPE. While somebody else publishes the instrument too, rival="WHO" at its end.
  [[nodiscard]] std::string text(const std::string& id) const;
  /// instrument_id, validity, reasons, rate_hz, latency_ms, estimate_age_ns, stages {name: state}; null for
  /// what is not known.
  [[nodiscard]] nlohmann::json to_json(const std::string& id) const;

 private:
  [[nodiscard]] std::string word() const;
  [[nodiscard]] std::optional<double> rate_hz() const;

  std::optional<TubeEvent> trouble_;  ///< since the newest estimate
  std::string rival_;                 ///< who else publishes the instrument; empty: nobody
  std::string validity_;
  std::string reasons_;
  std::uint64_t samples_ = 0;
  std::int64_t first_received_ns_ = 0;
  std::int64_t last_received_ns_ = 0;
  std::optional<double> latency_ms_;  ///< newest measurement to here; none without one
  std::optional<std::int64_t>
      estimate_age_ns_;  ///< of the newest status, as the daemon says it; -1: never one
  std::map<std::string, std::string> stages_;
  std::map<std::string, std::string> whys_;  ///< of the stages that have something to say
};

}  // namespace tubed
