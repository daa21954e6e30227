#include "bench/support/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "bench/support/machine.hpp"

namespace tubed {

namespace {

nlohmann::ordered_json json_of(const ReportRow& row) {
  nlohmann::ordered_json json{{"name", row.name},
                              {"unit", row.unit},
                              {"n", row.values.size()},
                              {"min", quantile(row.values, 0)},
                              {"p50", quantile(row.values, 0.5)},
                              {"p90", quantile(row.values, 0.9)},
                              {"p99", quantile(row.values, 0.99)},
                              {"drift", drift(row.values)}};
  if (!row.peer.empty()) {
    json["peer"] = row.peer;
    json["peer_min"] = quantile(row.peer_values, 0);
    json["peer_p50"] = quantile(row.peer_values, 0.5);
    json["speedup"] = quantile(row.peer_values, 0.5) / quantile(row.values, 0.5);
    json["speedup_min"] = quantile(row.peer_values, 0) / quantile(row.values, 0);
  }
  for (const auto& [key, value] : row.extra) {
    json[key] = value;
  }
  return json;
}

}  // namespace

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  const double place = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(std::floor(place));
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - std::floor(place)) * (values[above] - values[below]);
}

double drift(const std::vector<double>& values) {
  if (values.size() < 2) {
    return 1;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  return quantile({middle, values.end()}, 0.5) / quantile({values.begin(), middle}, 0.5);
}

void Report::add(ReportRow row) {
  if (row.values.empty() || (!row.peer.empty() && row.peer_values.empty())) {
    throw std::invalid_argument("report row '" + row.name + "' has no values");
  }
  rows_.push_back(std::move(row));
}

void Report::add(const std::string& name, const std::string& peer, TurnTimes times,
                 std::map<std::string, double> extra) {
  add({name, "ms", std::move(times.own_ms), peer, std::move(times.peer_ms), std::move(extra)});
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
  json["rows"] = nlohmann::ordered_json::array();
  for (const ReportRow& row : rows_) {
    json["rows"].push_back(json_of(row));
  }
  return json.dump(1) + "\n";
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
    const double p50 = quantile(row.values, 0.5);
    std::snprintf(line.data(), line.size(), "%-*s %7.3f %-2s %10.3f %6.2f", width, row.name.c_str(), p50,
                  row.unit.c_str(), quantile(row.values, 0), drift(row.values));
    text += line.data();
    if (!row.peer.empty()) {
      const double peer_p50 = quantile(row.peer_values, 0.5);
      std::snprintf(line.data(), line.size(), " %10.3f %8.2f  %.100s", peer_p50, peer_p50 / p50,
                    row.peer.c_str());
      text += line.data();
    }
    text += '\n';
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
