// The forms of the image likelihood that know how the tube looks: learnt on lines, asked on lines or pixels.
#pragma once

#include <vector>

#include "daemon/image/appearance_model.hpp"
#include "daemon/image/band_likelihood.hpp"
#include "daemon/image/image_likelihood.hpp"

namespace tubed {

/// Learns M_f and M_b without truth: where the ridges on the lines agree with each other. Adapts slowly, and
/// only while trusted.
class LineAppearance {
 public:
  LineAppearance();

  /// Finds the lines by their vesselness when nothing is known yet, and learns there if enough of them agree.
  LineSearch::Outcome begin(const ImageMeasurement& image, CorrespondenceLines& lines, int count,
                            int reach_px, LineSearch& search);

  /// Keeps the lines as they were found for trust().
  void remember(const CorrespondenceLines& lines, int count, int reach_px);

  void trust(const ImageMeasurement& image);
  void distrust();
  void forget();

  [[nodiscard]] const AppearanceModel& model() const { return model_; }

 private:
  void learn(const ImageMeasurement& image, double share);

  AppearanceModel model_;
  CorrespondenceLines found_;
  int count_ = 0;
  int reach_px_ = 0;  ///< nothing beyond was asked for, so nothing beyond is learnt
  bool confirmed_ = false;
  std::vector<PixelDistance> pixels_;  ///< scratch
};

/// Pixel-wise posteriors summed over the tube's width at every offset of every line.
class PosteriorLikelihood final : public ImageLikelihood {
 public:
  LineSearch::Outcome find(const ImageMeasurement& image, CorrespondenceLines& lines, int count, int reach_px,
                           LineSearch::Among among) override;
  void trust(const ImageMeasurement& image) override { appearance_.trust(image); }
  void distrust() override { appearance_.distrust(); }
  void forget() override { appearance_.forget(); }

 private:
  LineAppearance appearance_;
  LineSearch search_;
};

/// Eq. (16) over the band around the lines' bases: Newton's steps of each base along its normal, first with a
/// contour as wide as the lines reach (Eq. (17)), at last with a narrow one.
class BandPixelLikelihood final : public ImageLikelihood {
 public:
  LineSearch::Outcome find(const ImageMeasurement& image, CorrespondenceLines& lines, int count, int reach_px,
                           LineSearch::Among among) override;
  void trust(const ImageMeasurement& image) override { appearance_.trust(image); }
  void distrust() override { appearance_.distrust(); }
  void forget() override { appearance_.forget(); }

 private:
  void place_path(const CorrespondenceLines& lines, int count);
  void step(CorrespondenceLines& lines, int count, int reach_px, double epsilon_px);

  LineAppearance appearance_;
  LineSearch search_;
  BandLikelihood band_;
  BandDerivatives derivatives_;
  std::vector<PathVertex> path_;
  std::vector<BandOffset> offsets_;
  Eigen::Matrix2Xd normals_;
};

}  // namespace tubed
