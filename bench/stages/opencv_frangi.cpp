#include "bench/stages/opencv_frangi.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace tubed {

namespace {

cv::Mat sampled(double sigma, int order) {
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  cv::Mat kernel(1, 2 * reach + 1, CV_32F);
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    sum += std::exp(-0.5 * i * i / (sigma * sigma));
  }
  for (int i = -reach; i <= reach; ++i) {
    const double t = i / sigma;
    const double polynomial = order == 0 ? 1 : (order == 1 ? t / sigma : (t * t - 1) / (sigma * sigma));
    kernel.at<float>(i + reach) = static_cast<float>(polynomial * std::exp(-0.5 * t * t) / sum);
  }
  return kernel;
}

}  // namespace

OpencvFrangi::OpencvFrangi(const FrangiSettings& settings) : settings_(settings) {
  for (const double sigma : settings.scales_px) {
    scales_.push_back({sigma * sigma, sampled(sigma, 0), sampled(sigma, 1), sampled(sigma, 2)});
  }
}

float OpencvFrangi::max_norm(float variance) const {
  float greatest = 0;
  for (int y = 0; y < grey_.rows; ++y) {
    const auto* xx = xx_.ptr<float>(y);
    const auto* yy = yy_.ptr<float>(y);
    const auto* xy = xy_.ptr<float>(y);
    for (int x = 0; x < grey_.cols; ++x) {
      greatest = std::max(greatest, xx[x] * xx[x] + yy[x] * yy[x] + 2 * xy[x] * xy[x]);
    }
  }
  return variance * std::sqrt(greatest);
}

void OpencvFrangi::respond(float variance, float c, bool first) {
  const auto beta = static_cast<float>(settings_.beta);
  for (int y = 0; y < grey_.rows; ++y) {
    const auto* xx = xx_.ptr<float>(y);
    const auto* yy = yy_.ptr<float>(y);
    const auto* xy = xy_.ptr<float>(y);
    auto* out = vesselness_.ptr<float>(y);
    for (int x = 0; x < grey_.cols; ++x) {
      const float mean = 0.5F * variance * (xx[x] + yy[x]);
      const float difference = 0.5F * variance * (xx[x] - yy[x]);
      const float mixed = variance * xy[x];
      const float spread = std::sqrt(difference * difference + mixed * mixed);
      const float large = mean + spread;
      const float small = mean - spread;
      float response = 0;
      if (mean > 0) {
        const float ratio = small / large;
        response = std::exp(-ratio * ratio / (2 * beta * beta)) *
                   (1 - std::exp(-(large * large + small * small) / (2 * c * c)));
      }
      out[x] = first ? response : std::max(out[x], response);
    }
  }
}

const cv::Mat& OpencvFrangi::filter(const cv::Mat& grey) {
  grey.convertTo(grey_, CV_32F);
  vesselness_.create(grey.size(), CV_32F);
  bool first = true;
  for (const Scale& scale : scales_) {
    cv::sepFilter2D(grey_, xx_, CV_32F, scale.second, scale.smooth, {-1, -1}, 0, cv::BORDER_REPLICATE);
    cv::sepFilter2D(grey_, yy_, CV_32F, scale.smooth, scale.second, {-1, -1}, 0, cv::BORDER_REPLICATE);
    cv::sepFilter2D(grey_, xy_, CV_32F, scale.first, scale.first, {-1, -1}, 0, cv::BORDER_REPLICATE);
    const auto variance = static_cast<float>(scale.variance);
    const auto fixed = static_cast<float>(settings_.structureness);
    const float c = fixed > 0 ? fixed : std::max(0.5F * max_norm(variance), 1e-6F);
    respond(variance, c, first);
    first = false;
  }
  return vesselness_;
}

}  // namespace tubed
