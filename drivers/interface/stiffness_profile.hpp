// How stiff a catheter is along itself.
#pragma once

#include <cstddef>
#include <vector>

namespace tubed {

inline constexpr double kMinStiffness = 0.01;  ///< of the shaft's
inline constexpr double kMaxStiffness = 100;
inline constexpr double kMinStiffnessPiece_mm = 1;
inline constexpr std::size_t kMaxStiffnessPieces = 16;

/// Pieces from the tip on, each going on where the one before it ends. Behind the last one, and without any,
/// the catheter is as stiff as its shaft.
struct StiffnessProfile {
  struct Piece {
    double length_mm = 0;
    double times = 1;  ///< bending stiffness E I, as a multiple of the shaft's
    friend bool operator==(const Piece&, const Piece&) = default;
  };
  std::vector<Piece> pieces;

  /// From length and stiffness of each piece, one after the other; an odd last number is left out.
  static StiffnessProfile from_pairs(const std::vector<double>& numbers) {
    StiffnessProfile profile;
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      profile.pieces.push_back({numbers[i], numbers[i + 1]});
    }
    return profile;
  }

  [[nodiscard]] double length_mm() const {
    double sum_mm = 0;
    for (const Piece& piece : pieces) sum_mm += piece.length_mm;
    return sum_mm;
  }

  /// At the arc length s_mm from the tip, as a multiple of the shaft's. The first piece goes on beyond the
  /// tip.
  [[nodiscard]] double at(double s_mm) const {
    double end_mm = 0;
    for (const Piece& piece : pieces) {
      end_mm += piece.length_mm;
      if (s_mm < end_mm) return piece.times;
    }
    return 1;
  }

  friend bool operator==(const StiffnessProfile&, const StiffnessProfile&) = default;
};

}  // namespace tubed
