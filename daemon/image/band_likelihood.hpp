// The pixelwise likelihood of Eq. (15)-(18) in a band around a projected tube, with its derivatives by the
// places of the tube's centreline in the image.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "daemon/image/appearance_model.hpp"
#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// H_eps of Eq. (17) and its derivative by x; epsilon > 0, same unit as x.
double smooth_heaviside(double x, double epsilon);
double smooth_heaviside_slope(double x, double epsilon);

/// A point of the projected centreline; the next one is connected to it by a straight line.
struct PathVertex {
  Eigen::Vector2d p_px = Eigen::Vector2d::Zero();
  double half_width_px = 0;  ///< of the tube's projection there
};

/// What lies behind the path's last vertex.
enum class PathEnd {
  kCapped,  ///< background: the tube ends there
  kGoesOn,  ///< more tube, which is none of this path's business: no pixel there is asked
};

/// Derivatives of the log-likelihood by the vertices' places.
struct BandDerivatives {
  Eigen::Matrix2Xd gradient;  ///< one vertex a column, per px; exact
  /// Gauss-Newton: the sum over pixels of the outer products of the numerators' scores (per px^2), the
  /// Fisher information of Eq. (16) with its denominator held. Block tridiagonal.
  std::vector<Eigen::Matrix2d> information;       ///< of each vertex with itself
  std::vector<Eigen::Matrix2d> information_next;  ///< of each vertex (rows) with the next one (columns)
};

/// How far a vertex wants to move along a normal, for solvers that take image lines.
struct BandOffset {
  double offset_px = 0;
  double variance_px2 = 0;  ///< infinity where the band says nothing
};

/// One camera's band. Called by one thread; buffers grow to the image's size at first use.
class BandLikelihood {
 public:
  /// Takes as Omega the pixels nearer than `reach_px` to the path's contour (or inside it), with their P_f
  /// and P_b; behind the last vertex as `end` says. Pixels that are not measured are left out.
  /// Vertices may lie outside the image; those that are not finite are passed over.
  void choose_band(const ImageMeasurement& image, std::span<const PathVertex> path, double reach_px,
                   const AppearanceModel& model, PathEnd end = PathEnd::kCapped);

  /// Asks the model again for the pixels of the band.
  void weigh(const ImageMeasurement& image, const AppearanceModel& model);

  /// The band's pixels with their signed distance from the contour of the path it was chosen for: what an
  /// AppearanceModel learns from.
  [[nodiscard]] std::span<const PixelDistance> pixels() const { return pixels_; }

  /// Logarithm of Eq. (15) over the band, for a path of as many vertices as it was chosen for, with signed
  /// distance Phi = half width - distance from the path. `derivatives` may be nullptr. 0 for an empty band.
  double log_likelihood(std::span<const PathVertex> path, double epsilon_px, BandDerivatives* derivatives);

 private:
  struct Nearest {
    double distance_px;
    double along;  ///< 0 at the segment's first vertex, 1 at its second
    std::uint32_t segment;
    std::uint32_t round;  ///< of measure_distances() that wrote it
  };
  struct Weight {
    float foreground;
    float background;
  };

  void measure_distances(std::span<const PathVertex> path, double reach_px);
  void measure_segment(const PathVertex& a, const PathVertex& b, std::uint32_t segment, double reach_px);
  [[nodiscard]] double signed_distance(std::span<const PathVertex> path, const Nearest& nearest) const;
  void add_derivatives(std::span<const PathVertex> path, double epsilon_px, double normaliser,
                       BandDerivatives& derivatives) const;

  int width_ = 0;
  int height_ = 0;
  std::uint32_t round_ = 0;
  std::vector<Nearest> nearest_;  ///< one a pixel of the image
  std::vector<PixelDistance> pixels_;
  std::vector<Weight> weights_;  ///< one each of pixels_
};

/// Newton's step of each vertex along `normals` (2 x n, unit) with its neighbours held, and its variance:
/// what lets correspondence lines and this likelihood stand in for each other. `offsets` has n elements.
void offsets_along(const BandDerivatives& derivatives, const Eigen::Matrix2Xd& normals,
                   std::span<BandOffset> offsets);

}  // namespace tubed
