// A console whose filter over time gives way where something moves.
#pragma once

#include <span>
#include <vector>

namespace tubed {

/// A share of each image is of the image before, by its noise. Where that is so everywhere, undoing it shows
/// what moves as it is: there is a tube where it has just come, and background where it has just gone. A
/// console that averages less where much changes has shown that as it is; undoing it there would leave
/// something darker than the tube where that has come, and something brighter than the background where it
/// was. Ghosts on both sides are what is looked for. Where they are found small changes are undone, which are
/// averaged, and great ones are not. One a camera; called by one thread; never allocates after construction.
class MotionGhosts {
 public:
  /// For images of width x height pixels, of which one row in `stride` is looked at.
  MotionGhosts(int width, int height, int stride);

  /// The next image, row by row. `follows`: one exposure after the one before. `share`: of earlier images in
  /// it, 0 .. 1; 0: nothing would be undone, and nothing is looked for. `step`: the least difference of two
  /// grey values.
  void look_at(std::span<const float> grey, bool follows, double share, double step);

  /// As the images say in which enough has moved.
  [[nodiscard]] bool are_there() const { return are_there_; }

  /// How much of row `y` to undo then, pixel by pixel, 1 .. 0: half of it where the newest image has changed
  /// by eight times what noise changes. `change`: of that row against the image before. Preconditions: as
  /// many pixels in both, are_there().
  void weigh(int y, std::span<const float> change, std::span<float> weights) const;

 private:
  static constexpr int kBlock_px = 64;  ///< of one row, whose noise is one number

  /// Of what became brighter, or darker, between two images.
  struct Side {
    int moved = 0;     ///< pixels
    int ghosts = 0;    ///< of these, beyond all that is around them
    double share = 0;  ///< of ghosts, in the mean of the newest images
  };

  void look_at_row(std::span<const float> before, std::size_t first_block, double share);
  void look_at_pixel(int x, float change, double share);
  void judge();

  int width_;
  int height_;
  int stride_;
  bool has_before_ = false;
  std::vector<float> row_;     ///< of the newest image, smoothed
  std::vector<float> before_;  ///< all rows of the image before
  std::vector<float> noise_;   ///< of changes, standard deviation, of each block; 0: not yet known
  std::vector<float> scratch_;
  Side brighter_;
  Side darker_;
  float min_noise_ = 0;
  int informative_ = 0;  ///< images
  bool are_there_ = false;
};

}  // namespace tubed
