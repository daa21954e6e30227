// One JSON for every figure, and the same as a table for people.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/support/interleave.hpp"

namespace tubed {

/// A figure of a report: the distribution of one measurement, beside a peer's where there is one.
struct ReportRow {
  std::string name;                     ///< "frangi/400x600/4scales/full"
  std::string unit = "ms";              ///< of every value
  std::vector<double> values;           ///< in the order they were measured
  std::string peer;                     ///< what it was compared with by turns; empty: nothing
  std::vector<double> peer_values;      ///< as many turns of the peer
  std::map<std::string, double> extra;  ///< further members of the row: {"ns_per_px": 1.9}
};

/// The q-quantile (0 .. 1) of `values`, linear between neighbours. Precondition: not empty.
double quantile(std::vector<double> values, double q);

/// Ratio of the medians of the second to the first half: 1 when the machine stayed the same meanwhile.
double drift(const std::vector<double>& values);

/// Collects rows, then writes them. Rows keep their order.
class Report {
 public:
  /// Adds a row. Throws std::invalid_argument when it has no values.
  void add(ReportRow row);

  /// The usual row: both sides of take_turns().
  void add(const std::string& name, const std::string& peer, TurnTimes times,
           std::map<std::string, double> extra = {});

  /// {"git", "machine", "rows": [{"name", "unit", "n", "min", "p50", "p90", "p99", "drift", with a peer
  /// "peer", "peer_min", "peer_p50", "speedup" = peer_p50 / p50, "speedup_min" = peer_min / min}]}.
  [[nodiscard]] std::string json() const;

  /// name, p50, min, peer's p50, speed-up; one line a row, aligned.
  [[nodiscard]] std::string table() const;

  [[nodiscard]] const std::vector<ReportRow>& rows() const { return rows_; }

 private:
  std::vector<ReportRow> rows_;
};

/// Writes `text` to `path`; throws std::runtime_error with the path when it cannot.
void write_text(const std::string& path, const std::string& text);

}  // namespace tubed
