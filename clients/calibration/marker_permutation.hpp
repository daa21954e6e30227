// Could the touched markers be others than their names say? Searches all orders of the touched markers for
// those that fit about as well as the names.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/marker_pairs.hpp"

namespace tubed {

/// An order in which touched marker i is the world's marker `order[i]`.
struct MarkerOrder {
  std::vector<std::size_t> order;
  double squared_residuals_mm2 = 0;
  /// Natural logarithm of how much likelier the measurements are under this order than under the names, for
  /// markers that are off by the same unknown sigma in each direction, integrated over sigma: (3 n - 6) / 2
  /// times the logarithm of the ratio of squared residuals. A touch is not taken as better than 0.1 mm along
  /// each axis.
  double log_likelihood_ratio = 0;
  /// Of the number of orders that move as many markers.
  double log_alternatives = 0;
};

/// The best order other than that of the names, of those whose likelihood is at least e^`min_log_ratio` of
/// that of the names; nothing when there is none. Orders are found from all ordered triples of touched
/// markers for up to four triangles of markers (n^3 fits each), and all exchanges of two. n >= 3 markers that
/// are not on a line; with more than 20 only exchanges.
std::optional<MarkerOrder> best_other_order(const MarkerPairs& pairs, double min_log_ratio);

/// "M2 and M5 are exchanged", or "what was touched as M1, M2 and M3 is M2, M3 and M1".
std::string words_for(const MarkerOrder& order, const std::vector<std::string>& names);

}  // namespace tubed
