// What a person who mistyped a word may have meant.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// Insertions, deletions, replacements and swaps of neighbours (each character touched once) from `a` to `b`.
int edit_distance(std::string_view a, std::string_view b);

/// The candidate nearest to `word`, upper and lower case being the same: at most one edit for two characters
/// and three in all, or the word with its unit left off ("diameter" for "diameter_mm"). Nothing when none is
/// near.
std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace tubed
