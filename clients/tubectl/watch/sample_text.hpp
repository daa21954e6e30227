// Samples as a person reads them, one line each, and as JSON with every field under its name in the .idl
// file. NaN becomes null: JSON has no word for it. Arrays end at their counts.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "idl/dds_contract.hpp"

namespace tubed {

nlohmann::json to_json(const tubed_TubeEstimate& estimate);
nlohmann::json to_json(const tubed_EmSamples& samples);
nlohmann::json to_json(const tubed_TubeStatus& status);
nlohmann::json to_json(const tubed_TubeIdentity& identity);
nlohmann::json to_json(const tubed_TubeHealth& health);

/// Time, instrument, number, validity, reasons, tip, sigma at the tip and the latency until
/// `received_monotonic_ns`.
std::string line_of(const tubed_TubeEstimate& estimate, std::int64_t received_monotonic_ns);
/// "12ms", "0.4s", "3min" from nanoseconds; "never" below zero.
std::string age_text(std::int64_t age_ns);

std::string line_of(const tubed_EmSamples& samples);
std::string line_of(const tubed_TubeStatus& status);
std::string line_of(const tubed_TubeIdentity& identity);
std::string line_of(const tubed_TubeHealth& health);

/// When the newest measurement in a shape was made, CLOCK_MONOTONIC of the daemon's host: mid exposure if an
/// image of this instant took part, else the EM measurement; 0 if neither.
std::int64_t measured_monotonic_ns(const tubed_TubeEstimate& estimate);

}  // namespace tubed
