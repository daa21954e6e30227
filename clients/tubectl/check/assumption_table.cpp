#include <algorithm>
#include <nlohmann/json.hpp>

#include "clients/tubectl/check/aurora_assumptions.hpp"

namespace tubed {

namespace {

constexpr int kWide = 110;
constexpr int kNarrowest = 50;
constexpr std::size_t kIdWidth = 5;
constexpr std::size_t kVerdictWidth = 15;
constexpr std::size_t kTextWidth = 44;  ///< of the assumption, when the evidence stands beside it

/// `text` in lines of at most `width` characters, broken at blanks where there are any.
std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  while (text.size() > width) {
    const std::size_t blank = text.rfind(' ', width);
    const bool at_blank = blank != std::string_view::npos && blank > 0;
    lines.emplace_back(text.substr(0, at_blank ? blank : width));
    text.remove_prefix(at_blank ? blank + 1 : width);
  }
  lines.emplace_back(text);
  return lines;
}

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size(), width), ' ');
  return text;
}

std::string evidence_of(const Judgement& judgement) {
  const std::string time = judgement.time ? with_unit(seconds_of(*judgement.time), 3, "s: ") : "";
  return time + judgement.evidence;
}

std::string trimmed(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line + '\n';
}

std::string rows_of(const JudgedAssumption& one, std::size_t width) {
  const std::string head = padded(one.assumption->id, kIdWidth) +
                           padded(std::string(name_of(one.judgement.verdict)), kVerdictWidth);
  const std::string margin(head.size(), ' ');
  const std::string text = std::string(one.assumption->text) + " [" + one.assumption->known_by + "]";
  std::string rows;
  if (width < static_cast<std::size_t>(kWide)) {
    std::vector<std::string> lines = wrapped(text, width - head.size());
    for (const std::string& line : wrapped(evidence_of(one.judgement), width - head.size() - 2)) {
      lines.push_back("  " + line);
    }
    for (const std::string& line : lines) {
      rows += trimmed((rows.empty() ? head : margin) + line);
    }
    return rows;
  }
  const std::vector<std::string> left = wrapped(text, kTextWidth);
  const std::vector<std::string> right =
      wrapped(evidence_of(one.judgement), width - head.size() - kTextWidth - 2);
  for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
    rows += trimmed((i == 0 ? head : margin) + padded(i < left.size() ? left[i] : "", kTextWidth + 2) +
                    (i < right.size() ? right[i] : ""));
  }
  return rows;
}

std::vector<const char*> ids_with(const std::vector<JudgedAssumption>& judged, AssumptionVerdict verdict) {
  std::vector<const char*> ids;
  for (const JudgedAssumption& one : judged) {
    if (one.judgement.verdict == verdict) {
      ids.push_back(one.assumption->id);
    }
  }
  return ids;
}

}  // namespace

std::string assumption_table(const std::vector<JudgedAssumption>& judged, int width) {
  const auto columns = static_cast<std::size_t>(std::max(width, kNarrowest));
  std::string table;
  for (const JudgedAssumption& one : judged) {
    table += rows_of(one, columns);
  }
  std::string summary = std::to_string(ids_with(judged, AssumptionVerdict::kHolds).size()) + " hold";
  for (const AssumptionVerdict verdict : {AssumptionVerdict::kDoesNotHold, AssumptionVerdict::kNotTried}) {
    const auto ids = ids_with(judged, verdict);
    summary += "; " + std::to_string(ids.size()) +
               (verdict == AssumptionVerdict::kDoesNotHold ? " do not hold" : " not tried");
    for (std::size_t i = 0; i < ids.size(); ++i) {
      summary += (i == 0 ? ": " : " ") + std::string(ids[i]);
    }
  }
  for (const std::string& line : wrapped(summary, columns)) {
    table += line + '\n';
  }
  return table;
}

std::string assumption_json(const std::vector<JudgedAssumption>& judged, const std::string& tracker) {
  nlohmann::json all = nlohmann::json::array();
  for (const JudgedAssumption& one : judged) {
    const Judgement& judgement = one.judgement;
    all.push_back({{"id", one.assumption->id},
                   {"assumption", one.assumption->text},
                   {"known_by", one.assumption->known_by},
                   {"verdict", name_of(judgement.verdict)},
                   {"time_s", judgement.time ? nlohmann::json(seconds_of(*judgement.time)) : nullptr},
                   {"evidence", judgement.evidence}});
  }
  const nlohmann::json report{{"tracker", tracker},
                              {"assumptions", all},
                              {"holds", ids_with(judged, AssumptionVerdict::kHolds).size()},
                              {"does_not_hold", ids_with(judged, AssumptionVerdict::kDoesNotHold).size()},
                              {"not_tried", ids_with(judged, AssumptionVerdict::kNotTried).size()}};
  return report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n';
}

}  // namespace tubed
