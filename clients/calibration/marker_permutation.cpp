#include "clients/calibration/marker_permutation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "clients/calibration/marker_registration.hpp"

namespace tubed {

namespace {

using Order = std::vector<std::size_t>;
using Triangle = std::array<std::size_t, 3>;

constexpr std::size_t kMaxSearched = 20;
constexpr double kMinSigma_mm = 0.1;

Eigen::Vector3d at(const Eigen::Matrix3Xd& points, std::size_t index) {
  return points.col(static_cast<Eigen::Index>(index));
}

Eigen::Matrix3Xd in_order(const Eigen::Matrix3Xd& points, const Order& order) {
  Eigen::Matrix3Xd ordered(3, points.cols());
  for (std::size_t i = 0; i < order.size(); ++i) {
    ordered.col(static_cast<Eigen::Index>(i)) = at(points, order[i]);
  }
  return ordered;
}

double area_mm2(const Eigen::Matrix3Xd& points, const Triangle& t) {
  return (at(points, t[1]) - at(points, t[0])).cross(at(points, t[2]) - at(points, t[0])).norm() / 2;
}

/// Keeps the best order that is not that of the names.
class OrderSearch {
 public:
  OrderSearch(const MarkerPairs& pairs, double min_log_ratio) : pairs_(pairs), identity_(pairs.size()) {
    std::iota(identity_.begin(), identity_.end(), std::size_t{0});
    floor_mm2_ = degrees() * kMinSigma_mm * kMinSigma_mm;
    named_mm2_ = fit_rigid(pairs.p_world_mm, pairs.p_em_mm).squared_residuals_mm2 + floor_mm2_;
    best_mm2_ = named_mm2_ * std::exp(-2 * min_log_ratio / degrees());
  }

  void exchange_two() {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      for (std::size_t j = i + 1; j < pairs_.size(); ++j) {
        Order order = identity_;
        std::swap(order[i], order[j]);
        try_order(std::move(order));
      }
    }
  }

  /// All ordered triples of world markers for one triangle of touched ones.
  void place(const Triangle& touched) {
    const std::size_t n = pairs_.size();
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        if (a == b || !may_be(touched[0], touched[1], a, b)) continue;
        for (std::size_t c = 0; c < n; ++c) {
          if (c != a && c != b && may_be(touched[0], touched[2], a, c) &&
              may_be(touched[1], touched[2], b, c)) {
            complete(touched, {a, b, c});
          }
        }
      }
    }
  }

  [[nodiscard]] std::optional<MarkerOrder> best() const {
    if (best_.empty()) return std::nullopt;
    std::size_t moved = 0;
    for (std::size_t i = 0; i < best_.size(); ++i) moved += best_[i] == i ? 0 : 1;
    const auto n = static_cast<double>(best_.size());
    const auto m = static_cast<double>(moved);
    // n choose m, times the orders of m that leave none in place: m! / e, and one for m = 2
    const double choices = std::lgamma(n + 1) - std::lgamma(m + 1) - std::lgamma(n - m + 1);
    const double derangements = moved == 2 ? 0 : std::lgamma(m + 1) - 1;
    return MarkerOrder{best_, best_mm2_ - floor_mm2_, degrees() / 2 * std::log(named_mm2_ / best_mm2_),
                       choices + derangements};
  }

 private:
  [[nodiscard]] double degrees() const { return 3 * static_cast<double>(pairs_.size()) - 6; }

  /// No order with a better sum of squares has two distances that differ by more than this.
  [[nodiscard]] bool may_be(std::size_t i, std::size_t j, std::size_t a, std::size_t b) const {
    const double touched_mm = (at(pairs_.p_em_mm, i) - at(pairs_.p_em_mm, j)).norm();
    const double world_mm = (at(pairs_.p_world_mm, a) - at(pairs_.p_world_mm, b)).norm();
    return std::abs(touched_mm - world_mm) <= std::sqrt(2 * best_mm2_);
  }

  void complete(const Triangle& touched, const Triangle& world) {
    Eigen::Matrix3Xd p_em_mm(3, 3);
    Eigen::Matrix3Xd p_world_mm(3, 3);
    for (std::size_t i = 0; i < 3; ++i) {
      p_em_mm.col(static_cast<Eigen::Index>(i)) = at(pairs_.p_em_mm, touched[i]);
      p_world_mm.col(static_cast<Eigen::Index>(i)) = at(pairs_.p_world_mm, world[i]);
    }
    Order order = assign(fit_rigid(p_world_mm, p_em_mm).T_world_em);
    try_order(order);
    // once more from all markers: a triangle carries its own error outward
    try_order(assign(fit_rigid(in_order(pairs_.p_world_mm, order), pairs_.p_em_mm).T_world_em));
  }

  /// Each touched marker gets a world marker of its own, the nearest pairs first.
  [[nodiscard]] Order assign(const RigidTransform& T_world_em) const {
    const std::size_t n = pairs_.size();
    std::vector<std::tuple<double, std::size_t, std::size_t>> distances;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d p_world_mm = T_world_em * at(pairs_.p_em_mm, i);
      for (std::size_t j = 0; j < n; ++j) {
        distances.emplace_back((p_world_mm - at(pairs_.p_world_mm, j)).squaredNorm(), i, j);
      }
    }
    std::sort(distances.begin(), distances.end());
    Order order(n, n);
    std::vector<bool> is_taken(n, false);
    for (const auto& [distance, i, j] : distances) {
      if (order[i] == n && !is_taken[j]) {
        order[i] = j;
        is_taken[j] = true;
      }
    }
    return order;
  }

  void try_order(Order order) {
    if (order == identity_ || order == best_) return;
    const double squared_mm2 =
        fit_rigid(in_order(pairs_.p_world_mm, order), pairs_.p_em_mm).squared_residuals_mm2 + floor_mm2_;
    if (squared_mm2 < best_mm2_) {
      best_mm2_ = squared_mm2;
      best_ = std::move(order);
    }
  }

  const MarkerPairs& pairs_;
  Order identity_;
  Order best_;
  double floor_mm2_ = 0;
  double named_mm2_ = 0;
  double best_mm2_ = 0;
};

/// The largest triangle of the touched markers, then the largest without each of its corners.
std::vector<Triangle> large_triangles(const Eigen::Matrix3Xd& points) {
  const auto n = static_cast<std::size_t>(points.cols());
  const auto largest = [&](std::size_t without) {
    Triangle best{0, 1, 2};
    double best_mm2 = -1;
    for (Triangle t{0, 0, 0}; t[0] < n; ++t[0]) {
      for (t[1] = t[0] + 1; t[1] < n; ++t[1]) {
        for (t[2] = t[1] + 1; t[2] < n; ++t[2]) {
          const bool is_left_out = std::find(t.begin(), t.end(), without) != t.end();
          if (!is_left_out && area_mm2(points, t) > best_mm2) {
            best_mm2 = area_mm2(points, t);
            best = t;
          }
        }
      }
    }
    return best;
  };
  std::vector<Triangle> triangles{largest(n)};
  for (const std::size_t corner : Triangle(triangles.front())) {
    if (n > 3) triangles.push_back(largest(corner));
  }
  return triangles;
}

}  // namespace

std::optional<MarkerOrder> best_other_order(const MarkerPairs& pairs, double min_log_ratio) {
  OrderSearch search(pairs, min_log_ratio);
  search.exchange_two();
  if (pairs.size() <= kMaxSearched) {
    for (const Triangle& triangle : large_triangles(pairs.p_em_mm)) search.place(triangle);
  }
  return search.best();
}

std::string words_for(const MarkerOrder& order, const std::vector<std::string>& names) {
  std::vector<std::string> touched;
  std::vector<std::string> really;
  for (std::size_t i = 0; i < order.order.size(); ++i) {
    if (order.order[i] == i) continue;
    touched.push_back(names[i]);
    really.push_back(names[order.order[i]]);
  }
  return touched.size() == 2 ? list_of(touched) + " are exchanged"
                             : "what was touched as " + list_of(touched) + " is " + list_of(really);
}

}  // namespace tubed
