// The Frangi filter as one writes it with OpenCV: the peer of ours.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "daemon/image/frangi_settings.hpp"

namespace tubed {

/// Three sepFilter2D per scale with derivatives of a Gaussian, then one loop over the pixels for eigenvalues,
/// Frangi's response and the maximum over scales. Dark ridges; c as our settings say it.
class OpencvFrangi {
 public:
  explicit OpencvFrangi(const FrangiSettings& settings);

  /// `grey`: 8 or 16 bit or float, one channel. Returns float of the same size; reuses its memory.
  const cv::Mat& filter(const cv::Mat& grey);

 private:
  struct Scale {
    double variance;
    cv::Mat smooth;  ///< kernels, sampled in double, cut at 4 sigma
    cv::Mat first;
    cv::Mat second;
  };
  float max_norm(float variance) const;
  void respond(float variance, float c, bool first);

  FrangiSettings settings_;
  std::vector<Scale> scales_;
  cv::Mat grey_, xx_, yy_, xy_, vesselness_;
};

}  // namespace tubed
