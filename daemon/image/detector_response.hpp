// Grey values that are the logarithm of what a detector counts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tubed {

/// Behind a centimetre of bone or of air, a tube takes the same share of the X-rays that reach it (Beer and
/// Lambert), so of a linear detector's intensities it takes more where it is bright; of their logarithms it
/// takes the same everywhere. One a camera; all memory is taken in the constructor.
class LogTable {
 public:
  static constexpr int kMaxWord = 65535;

  LogTable() : logs_(kMaxWord + 1) {}

  /// For intensities 0 .. white, of which intensity x is the word x * words_per_level, at most kMaxWord:
  /// log(1 + x / d) on a scale where that of `white` is 65535, in whole numbers; d = white / 128, below which
  /// there is more noise than tube, so that there the logarithm flattens. Does nothing for the values it had
  /// before.
  void set(float white, float words_per_level);

  [[nodiscard]] float operator[](std::uint32_t word) const { return logs_[word]; }

 private:
  std::vector<float> logs_;
  float white_ = 0;
  float words_per_level_ = 0;
};

/// Tells a linear detector from one that delivers logarithms by the noise of its images. Quanta are counted
/// with a standard deviation that grows with the root of the intensity; that of its logarithm falls with it.
/// So the slope of log(noise) over log(grey) is 1/2 for the one, less where electronics add their noise, and
/// negative for the other.
class ResponseFinder {
 public:
  /// Looks at one image of 16-bit words, row by row, with squares of `square_px` a side as one: light spreads
  /// over several pixels before it is read out, so that of pixel to pixel there is little but the
  /// electronics' noise, which is even. Never allocates.
  void look_at(std::span<const std::uint8_t> words, int width, int height, int square_px);

  /// Has the answer been found? What was found in one image stays.
  [[nodiscard]] bool is_known() const { return is_known_; }
  [[nodiscard]] bool is_linear() const { return is_linear_; }
  /// Of the image that decided, or of the last one that could not.
  [[nodiscard]] double slope() const { return slope_; }

 private:
  static constexpr std::size_t kBins = 64;  ///< of grey value, by its logarithm

  /// Noise of the pixels of one grey value.
  struct Bin {
    double sum_of_steps = 0;
    double sum_of_logs = 0;
    int count = 0;
  };

  void add(double grey, double step);
  void decide();

  std::array<Bin, kBins> bins_{};
  double slope_ = 0;
  bool is_known_ = false;
  bool is_linear_ = false;
};

}  // namespace tubed
