// What a console does to the pictures of its detector before anybody sees them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"
#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"

namespace tubed {

/// What consoles of cathlabs do, all at once and not a little of it, for pixels of 0.6 mm.
ConsoleSettings typical_console();

/// The console behind one view. The order is that of the hardware: grid and vignetting act on the quanta; in
/// the logarithm come automatic brightness, temporal filter, unsharp mask and the table of grey values; text
/// is burnt into the words at the end. Used by one thread; never allocates after construction.
class Console {
 public:
  /// `settings`: checked. Pictures of width x height pixels.
  Console(const ConsoleSettings& settings, int width, int height);

  /// Of expected quanta, a pixel: what grid lines and vignetting leave of them, in place.
  void shade(std::span<float> quanta) const;

  /// Of `picture`, -log of a pixel, of which `dark` is shown black and `bright` white: in place.
  void process(float dark, float bright, std::span<float> picture);

  /// Writes a clock that shows `time_s` into the upper left corner and the number of the exposure into the
  /// upper right one, white on black. text_areas() are what that changes. `full`: the word of white.
  template <typename Pixel>
  void burn_in(double time_s, std::int64_t exposure, Pixel full, std::span<Pixel> pixels) const;

  /// x, y, width, height of each rectangle that burn_in() writes into, one after the other; empty without
  /// text.
  [[nodiscard]] static std::vector<int> text_areas(const ConsoleSettings& settings, int width, int height);

 private:
  void follow_brightness(float dark, float bright, std::span<float> picture);
  void filter_in_time(std::span<float> picture);
  void filter_what_stands_still(std::span<float> picture);
  void enhance_edges(std::span<float> picture);
  void apply_table(float dark, float bright, std::span<float> picture) const;

  ConsoleSettings settings_;
  int width_;
  int height_;
  std::vector<float> shade_;  ///< factor a pixel; empty: all 1
  PointSpread edge_blur_;
  std::vector<float> blurred_;
  std::vector<float> filtered_;  ///< of the temporal filter
  std::vector<float> sample_;    ///< some pixels, for their median
  bool has_filtered_ = false;
  float settled_ = 0;     ///< median of the first picture
  float taken_back_ = 0;  ///< what automatic brightness subtracts now
  bool is_settled_ = false;
};

}  // namespace tubed
