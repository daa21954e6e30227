// Images that a console averages over time, and what its detector saw.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "daemon/image/image_measurement.hpp"
#include "daemon/image/motion_ghosts.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// An image is I_t = phi_1 I_{t-1} + phi_2 I_{t-2} + (1 - phi_1 - phi_2) X_t of what reaches the detector,
/// X_t: of the image before, a console keeps a share w, so that there is less noise, and a detector a share l
/// of what it saw: phi_1 = w + l, phi_2 = -w l. Whatever moves lags behind and leaves a ghost.
struct TemporalFilter {
  double share = 0;   ///< the greater of w and l; 0: no filter
  double second = 0;  ///< the other one, about 0 where there is none

  [[nodiscard]] bool any() const { return share > 0; }
  /// What is of earlier images in an image, 0 .. 1.
  [[nodiscard]] double of_before() const { return phi_1() + phi_2(); }
  [[nodiscard]] double phi_1() const { return share + second; }
  [[nodiscard]] double phi_2() const { return -share * second; }
};

/// Correlation of differences D of successive images, second ones along rows, with those one, two and three
/// exposures before.
struct DifferenceCorrelations {
  double by_one = 0;
  double by_two = 0;
  double by_three = 0;
};

/// Finds the filter by the noise, which in X is independent from exposure to exposure. What stands still has
/// no part in D, and D follows the recursion of I with X_t - X_{t-1} for X_t, so that its correlations r_1,
/// r_2 give phi_1 = (1 + 2 r_1 + r_2) / (1 + r_1), phi_2 = r_2 - phi_1 r_1, and r_3 = phi_1 r_2 + phi_2 r_1
/// has to hold. Nothing where that is no such filter, or too weak to be worth mending.
std::optional<TemporalFilter> filter_of(const DifferenceCorrelations& r);

/// One a camera; called by one thread; never allocates after construction.
class TemporalFilterFinder {
 public:
  /// For images of width x height pixels; of less than 68 columns nothing is ever found.
  TemporalFilterFinder(int width, int height);

  /// Looks at one image, row by row. `step`: the least difference of two grey values, by which they were
  /// rounded; of a mean of n pixels, 1 / sqrt(n).
  void look_at(std::span<const float> grey, MonotonicTime exposure, double step);

  /// As eight images in a row had it, and half of the newest eight still do.
  [[nodiscard]] const TemporalFilter& filter() const { return filter_; }

  /// Where are_there(), the filter averages less where something moves.
  [[nodiscard]] const MotionGhosts& ghosts() const { return ghosts_; }

  /// How many exposures the newest image is after the one before: 1 in the rhythm of those before, 2 or 3
  /// where some are missing in it, 0 where nobody can say.
  [[nodiscard]] int exposures_between() const { return exposures_between_; }

 private:
  static constexpr int kBlock_px = 64;  ///< of one row, whose noise is looked at together
  static constexpr std::size_t kWitnesses = 8;
  static constexpr int kBefore = 3;  ///< differences before the newest one

  void keep_rhythm(MonotonicTime exposure);
  void correlate(std::span<const float> grey, double step);
  void correlate_block(const float* grey, std::size_t block, double step);
  void read();
  [[nodiscard]] std::size_t agreeing_with(const DifferenceCorrelations& asked) const;

  int width_;
  int height_;
  int stride_ = 1;      ///< one row in so many is looked at
  int blocks_ = 0;      ///< of a row
  int remembered_ = 0;  ///< images in a row that the differences below are of, kBefore + 1 at most
  MonotonicTime newest_{};
  double rhythm_s_ = 0;  ///< between two images; 0: not known
  double odd_s_ = 0;     ///< the last interval that was none of the rhythm
  int exposures_between_ = 0;
  TemporalFilter filter_;
  DifferenceCorrelations agreed_;                              ///< what filter_ is of
  std::array<DifferenceCorrelations, kWitnesses> readings_{};  ///< of the newest images, in turn
  std::size_t next_ = 0;                                       ///< place in readings_
  std::size_t read_ = 0;                                       ///< images
  std::vector<float> curved_;                        ///< second differences along rows, of the newest image
  std::array<std::vector<float>, kBefore> changed_;  ///< D of the newest image, of the one before, ...
  std::array<std::vector<float>, kBefore> by_;       ///< scratch: correlations of each block
  MotionGhosts ghosts_;
};

/// X_t = (I_t - phi_1 I_{t-1} - phi_2 I_{t-2}) / (1 - phi_1 - phi_2). One a camera; called by one thread;
/// never allocates after construction.
class TemporalFilterInverse {
 public:
  TemporalFilterInverse(int width, int height);

  /// Takes what is of the images before out of the grey values of `image`, which stay within 0 .. `white`,
  /// and keeps what they were for the next one. `exposures_between`: as TemporalFilterFinder has it. With 0,
  /// or without an image before, it is only kept; where I_{t-2} is missing, phi_1 is `share` and phi_2 is 0;
  /// where I_{t-1} is, the share of what is left of I_{t-n} is that to the power of n. `ghosts`, where they
  /// are there, say where less is undone.
  void undo(const TemporalFilter& filter, const MotionGhosts& ghosts, int exposures_between, float white,
            ImageMeasurement& image);
  /// The next image is a first one.
  void forget() { kept_ = 0; }

 private:
  /// seen = scale * shown - of_before * I_{t-1} - of_two_before * I_{t-2}
  struct Inverse {
    float scale;
    float of_before;
    float of_two_before;
  };

  void keep(std::span<const float> grey);
  void undo_row(const Inverse& inverse, std::size_t first, std::span<const float> shown);
  void hold_what_moved(const MotionGhosts& ghosts, int y, std::size_t first, std::span<const float> shown);

  std::vector<std::uint16_t> before_;  ///< grey values times words_
  std::vector<std::uint16_t> two_before_;
  std::vector<float> seen_;  ///< scratch, of one row, as the next two
  std::vector<float> change_;
  std::vector<float> weights_;
  float words_ = 1;
  int kept_ = 0;  ///< of the two
};

}  // namespace tubed
