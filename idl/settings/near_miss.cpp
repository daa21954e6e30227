#include "idl/settings/near_miss.hpp"

#include <algorithm>
#include <cctype>

namespace tubed {

namespace {

// Longer words are not mistyped keys, and the distance costs the product of the lengths.
constexpr std::size_t kMaxWord = 64;

std::string lower_case(std::string_view word) {
  std::string lower(word);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  // Three rows of the table: swaps look two rows back.
  std::vector<int> before_last(b.size() + 1);
  std::vector<int> last(b.size() + 1);
  std::vector<int> current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    last[j] = static_cast<int>(j);
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({last[j] + 1, current[j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        current[j] = std::min(current[j], before_last[j - 2] + 1);
      }
    }
    before_last.swap(last);
    last.swap(current);
  }
  return last[b.size()];
}

std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.empty() || word.size() > kMaxWord) {
    return std::nullopt;
  }
  const std::string lower = lower_case(word);
  std::optional<std::string> nearest;
  int nearest_distance = 4;
  for (const std::string& candidate : candidates) {
    const std::string lower_candidate = lower_case(candidate);
    const int longest = static_cast<int>(std::max(lower.size(), lower_candidate.size()));
    const bool unit_left_off = lower_candidate.starts_with(lower + "_");
    const int distance = unit_left_off ? 1 : edit_distance(lower, lower_candidate);
    if (distance <= std::clamp(longest / 2, 1, 3) && distance < nearest_distance) {
      nearest = candidate;
      nearest_distance = distance;
    }
  }
  return nearest;
}

}  // namespace tubed
