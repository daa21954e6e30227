// What kind of move it was, and about how much: for words, and for where to look for a view that moved.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "daemon/image/view_picture.hpp"

namespace tubed {

/// How a background lies now against where it lay before.
struct BackgroundMotion {
  enum class Kind {
    kUnknown,    ///< too few parts of the picture are found again
    kPanned,     ///< all parts by the same way
    kMagnified,  ///< in proportion to their distance from one point
    kTurned,     ///< parts moved differently: near and far ones, as when a C-arm turns
  };
  Kind kind = Kind::kUnknown;
  Eigen::Vector2d shift_mm{0, 0};  ///< of the middle of the picture, right and down, where the patient is
  double magnification = 1;        ///< now over before
  double agreeing_share = 0;       ///< of the parts that were found again, 0 .. 1
};

/// Finds parts of an older picture in a new one by normalised correlation and asks whether one shift and one
/// magnification explains them. Some milliseconds; memory is taken in the constructor. One thread.
class BackgroundMotionFinder {
 public:
  /// For pictures of that size, in reduced pixels.
  BackgroundMotionFinder(Eigen::Index rows, Eigen::Index columns);

  /// Textures of two pictures; 0 where they are not open. `mm_per_px`: of a reduced pixel, where the patient
  /// is. Shifts beyond 24 halved pixels, about 60 mm, are not found. Never allocates.
  BackgroundMotion find(const TextureGrid& before, const TextureGrid& now, double mm_per_px);

 private:
  /// A part of the older picture and where it lies now, in halved pixels from the middle of the picture.
  struct Match {
    Eigen::Vector2d place;
    Eigen::Vector2d shift;
  };
  /// shift = offset + (magnification - 1) place.
  struct Model {
    Eigen::Vector2d offset{0, 0};
    double magnification = 1;
  };

  static void halve(const TextureGrid& from, PixelGrid& to);
  void sum_squares();
  [[nodiscard]] float energy_of_now(Eigen::Index row, Eigen::Index column) const;
  void match_all();
  void match(Eigen::Index row, Eigen::Index column, float energy);
  [[nodiscard]] int count_agreeing(const Model& model) const;
  [[nodiscard]] Model best_pan() const;
  [[nodiscard]] Model best_magnification() const;
  [[nodiscard]] Model refined(const Model& model, bool may_magnify) const;

  PixelGrid before_, now_;   ///< halved
  Eigen::ArrayXXd squares_;  ///< sums of now_ squared above and left of each pixel
  PixelGrid scores_;         ///< of the part at hand, for each shift
  std::vector<Match> matches_;
  int parts_ = 0;  ///< with a texture
};

}  // namespace tubed
