#include "bench/support/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "bench/support/machine.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMinForDistribution = 20;
constexpr double kMaxDrift = 1.15;

/// Five digits are more than any latency is worth; all seventeen would make the file many times larger.
double rounded(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.5g", value);
  return std::strtod(text.data(), nullptr);
}

/// [[percent, value], ..]: nine steps a decade towards 100 %, as far as there are values for them.
nlohmann::ordered_json percentile_curve(const std::vector<double>& unsorted) {
  std::vector<double> values = unsorted;
  std::sort(values.begin(), values.end());
  nlohmann::ordered_json curve = nlohmann::ordered_json::array();
  for (int step = 1; step < 50; ++step) {
    curve.push_back({step, rounded(percentile(values, step))});
  }
  for (double beyond = 50; beyond * static_cast<double>(values.size()) / 100 >= 1; beyond *= 0.8) {
    curve.push_back({rounded(100 - beyond), rounded(percentile(values, 100 - beyond))});
  }
  curve.push_back({100, rounded(values.back())});
  return curve;
}

/// [[lower edge, upper edge, count], ..]: 50 bins a decade; values of 0 and below are in the lowest.
nlohmann::ordered_json log_histogram(const std::vector<double>& values) {
  constexpr double kBinsADecade = 50;
  constexpr double kMin = 1e-9;
  std::map<int, int> counts;
  for (const double value : values) {
    ++counts[static_cast<int>(std::floor(std::log10(std::max(value, kMin)) * kBinsADecade))];
  }
  nlohmann::ordered_json bins = nlohmann::ordered_json::array();
  for (const auto& [bin, count] : counts) {
    bins.push_back(
        {rounded(std::pow(10, bin / kBinsADecade)), rounded(std::pow(10, (bin + 1) / kBinsADecade)), count});
  }
  return bins;
}

/// [[t_s, median, greatest], ..] of stretches of equal count, at most 150 of them.
nlohmann::ordered_json series(const ReportRow& row) {
  constexpr std::size_t kMaxPoints = 150;
  const std::size_t stretch = row.values.size() / kMaxPoints + 1;
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (std::size_t begin = 0; begin < row.values.size(); begin += stretch) {
    const std::size_t end = std::min(begin + stretch, row.values.size());
    const std::vector<double> part(row.values.begin() + static_cast<std::ptrdiff_t>(begin),
                                   row.values.begin() + static_cast<std::ptrdiff_t>(end));
    points.push_back(
        {rounded(row.t_s[begin]), rounded(percentile(part, 50)), rounded(percentile(part, 100))});
  }
  return points;
}

nlohmann::ordered_json json_of(const ReportRow& row) {
  nlohmann::ordered_json json{{"name", row.name},
                              {"unit", row.unit},
                              {"n", row.values.size()},
                              {"min", rounded(percentile(row.values, 0))},
                              {"p50", rounded(percentile(row.values, 50))},
                              {"p90", rounded(percentile(row.values, 90))},
                              {"p99", rounded(percentile(row.values, 99))},
                              {"max", rounded(percentile(row.values, 100))},
                              {"drift", rounded(drift(row.values))}};
  if (is_unsteady(row.values)) {
    json["flagged"] = true;
  }
  if (!row.peer.empty()) {
    json["peer"] = row.peer;
    json["peer_min"] = rounded(percentile(row.peer_values, 0));
    json["peer_p50"] = rounded(percentile(row.peer_values, 50));
    json["speedup"] = rounded(percentile(row.peer_values, 50) / percentile(row.values, 50));
    json["speedup_min"] = rounded(percentile(row.peer_values, 0) / percentile(row.values, 0));
  }
  for (const auto& [key, value] : row.extra) {
    json[key] = rounded(value);
  }
  if (row.values.size() >= kMinForDistribution) {
    json["curve"] = percentile_curve(row.values);
    json["histogram"] = log_histogram(row.values);
  }
  if (!row.t_s.empty()) {
    json["series"] = series(row);
  }
  return json;
}

}  // namespace

double percentile(std::vector<double> values, double percent) {
  std::sort(values.begin(), values.end());
  const double place = percent / 100 * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(std::floor(place));
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - std::floor(place)) * (values[above] - values[below]);
}

double drift(const std::vector<double>& values) {
  if (values.size() < 2) {
    return 1;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  return percentile({middle, values.end()}, 50) / percentile({values.begin(), middle}, 50);
}

bool is_unsteady(const std::vector<double>& values) {
  constexpr std::size_t kMinForDrift = 8;  // of fewer values halves say nothing
  if (values.size() < kMinForDrift) {
    return false;
  }
  const double ratio = drift(values);
  return ratio > kMaxDrift || ratio < 1 / kMaxDrift;
}

void Report::add(ReportRow row) {
  if (row.t_s.size() != row.values.size() && !row.t_s.empty()) {
    throw std::invalid_argument("report row '" + row.name + "' has not one time a value");
  }
  if (row.values.empty() || (!row.peer.empty() && row.peer_values.empty())) {
    throw std::invalid_argument("report row '" + row.name + "' has no values");
  }
  rows_.push_back(std::move(row));
}

void Report::add(const std::string& name, const std::string& peer, TurnTimes times,
                 std::map<std::string, double> extra) {
  add({name, "ms", std::move(times.own_ms), peer, std::move(times.peer_ms), std::move(extra), {}});
}

std::string Report::json() const {
  const Machine machine = this_machine();
  nlohmann::ordered_json json;
  json["git"] = source_revision();
  json["machine"] = {{"cpu", machine.cpu},
                     {"cores", machine.cores},
                     {"kernel", machine.kernel},
                     {"flags", machine.flags},
                     {"load", machine.load}};
  if (!command_.empty()) {
    json["command"] = command_;
  }
  // One row a line: files that people can read and git can compare.
  std::string text = json.dump();
  text.back() = ',';
  text += "\n\"rows\": [";
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    text += (i == 0 ? "\n" : ",\n") + json_of(rows_[i]).dump();
  }
  return text + "\n]}\n";
}

std::string Report::table() const {
  std::size_t widest = 4;
  for (const ReportRow& row : rows_) {
    widest = std::max(widest, row.name.size());
  }
  std::vector<char> line(widest + 160);
  const auto width = static_cast<int>(widest);
  std::snprintf(line.data(), line.size(), "%-*s %10s %10s %6s %10s %8s  %s\n", width, "name", "p50", "min",
                "drift", "peer p50", "speed-up", "peer");
  std::string text = line.data();
  for (const ReportRow& row : rows_) {
    const double p50 = percentile(row.values, 50);
    std::snprintf(line.data(), line.size(), "%-*s %7.3f %-2s %10.3f %6.2f", width, row.name.c_str(), p50,
                  row.unit.c_str(), percentile(row.values, 0), drift(row.values));
    text += line.data();
    if (!row.peer.empty()) {
      const double peer_p50 = percentile(row.peer_values, 50);
      std::snprintf(line.data(), line.size(), " %10.3f %8.2f  %.100s", peer_p50, peer_p50 / p50,
                    row.peer.c_str());
      text += line.data();
    }
    text += is_unsteady(row.values) ? "  UNSTEADY\n" : "\n";
  }
  return text;
}

void write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  if (!(file << text).flush()) {
    throw std::runtime_error("cannot write " + path);
  }
}

}  // namespace tubed
