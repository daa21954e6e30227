// One JSON for every figure, and the same as a table for people.
#pragma once

#include <map>
#include <string>
#include <utility>
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
  std::vector<double> t_s;              ///< when each value was measured; empty: no series is written
};

/// That percentile (0 .. 100) of `values`, linear between neighbours. Precondition: not empty.
double percentile(std::vector<double> values, double percent);

/// Ratio of the medians of the second to the first half: 1 when the machine stayed the same meanwhile.
double drift(const std::vector<double>& values);

/// The two halves differ by more than 15 %: something else happened to the machine, measure again.
bool is_unsteady(const std::vector<double>& values);

/// Collects rows, then writes them. Rows keep their order.
class Report {
 public:
  /// Adds a row. Throws std::invalid_argument when it has no values.
  void add(ReportRow row);

  /// The usual row: both sides of take_turns().
  void add(const std::string& name, const std::string& peer, TurnTimes times,
           std::map<std::string, double> extra = {});

  /// What was typed to get these figures; written as "command".
  void set_command(std::string command) { command_ = std::move(command); }

  /// {"git", "machine", "command", "rows": [{"name", "unit", "n", "min", "p50", "p90", "p99", "max", "drift",
  /// "flagged" when unsteady, with a peer "peer", "peer_min", "peer_p50", "speedup" = peer_p50 / p50,
  /// "speedup_min" = peer_min / min; from 20 values on "curve" [[percent, value]] and "histogram" [[from,
  /// to, count]]; with times "series" [[t_s, median, max]]}]}.
  [[nodiscard]] std::string json() const;

  /// name, p50, min, peer's p50, speed-up; one line a row, aligned.
  [[nodiscard]] std::string table() const;

  [[nodiscard]] const std::vector<ReportRow>& rows() const { return rows_; }

 private:
  std::string command_;
  std::vector<ReportRow> rows_;
};

/// Writes `text` to `path`; throws std::runtime_error with the path when it cannot.
void write_text(const std::string& path, const std::string& text);

}  // namespace tubed
