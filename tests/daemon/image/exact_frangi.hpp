// Frangi's vesselness by the book, in double: Gaussian derivatives sampled at sigma itself and cut at 7
// sigma, outermost pixels repeated. Slow; what the filter is held against.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tubed {

struct ExactImage {
  int width = 0;
  int height = 0;
  std::vector<double> pixels;

  [[nodiscard]] double at(int x, int y) const {
    return pixels[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(std::clamp(x, 0, width - 1))];
  }
};

/// The `order`-th derivative of a Gaussian at -reach .. reach.
inline std::vector<double> gaussian_derivative(double sigma, int order) {
  const int reach = static_cast<int>(std::ceil(7 * sigma));
  std::vector<double> weights;
  for (int i = -reach; i <= reach; ++i) {
    const double t = i / sigma;
    const double hermite = order == 0 ? 1 : (order == 1 ? -t / sigma : (t * t - 1) / (sigma * sigma));
    weights.push_back(hermite * std::exp(-0.5 * t * t) / (sigma * std::sqrt(2 * M_PI)));
  }
  return weights;
}

inline ExactImage convolved(const ExactImage& image, const std::vector<double>& along_x,
                            const std::vector<double>& along_y) {
  const int reach = static_cast<int>(along_x.size() / 2);
  ExactImage rows = image;
  ExactImage both = image;
  for (int pass = 0; pass < 2; ++pass) {
    const ExactImage& from = pass == 0 ? image : rows;
    ExactImage& to = pass == 0 ? rows : both;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        double sum = 0;
        for (int k = -reach; k <= reach; ++k) {
          const auto i = static_cast<std::size_t>(k + reach);
          sum += pass == 0 ? along_x[i] * from.at(x - k, y) : along_y[i] * from.at(x, y - k);
        }
        to.pixels[static_cast<std::size_t>(y * image.width + x)] = sum;
      }
    }
  }
  return both;
}

/// One scale's response; c <= 0: half the greatest Hessian norm. `polarity`: 1 for dark ridges, -1 for
/// bright.
inline std::vector<double> exact_frangi(const ExactImage& image, double sigma, double beta, double c,
                                        double polarity) {
  const auto smooth = gaussian_derivative(sigma, 0);
  const auto first = gaussian_derivative(sigma, 1);
  const auto second = gaussian_derivative(sigma, 2);
  const ExactImage xx = convolved(image, second, smooth);
  const ExactImage yy = convolved(image, smooth, second);
  const ExactImage xy = convolved(image, first, first);
  const double scale = polarity * sigma * sigma;
  double greatest = 0;
  std::vector<double> response(image.pixels.size());
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t i = 0; i < response.size(); ++i) {
      const double mean = 0.5 * scale * (xx.pixels[i] + yy.pixels[i]);
      const double spread = std::hypot(0.5 * scale * (xx.pixels[i] - yy.pixels[i]), scale * xy.pixels[i]);
      const double large = mean + spread;
      const double small = mean - spread;
      greatest = std::max(greatest, std::hypot(large, small));
      const double used_c = c > 0 ? c : 0.5 * greatest;
      const double ratio = large > 0 ? small / large : 0;
      const double norm = large * large + small * small;
      response[i] = mean > 0 ? std::exp(-ratio * ratio / (2 * beta * beta)) *
                                   (1 - std::exp(-norm / (2 * used_c * used_c)))
                             : 0;
    }
  }
  return response;
}

/// Dark curved tubes of several widths on a slope, with noise; grey values `least` .. `least + span`.
inline ExactImage tubes_with_noise(int width, int height, double least, double span, double noise) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0, noise);
  ExactImage image{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double grey = 0.5 + 0.3 * x / width;
      for (int tube = 0; tube < 3; ++tube) {
        const double centre = height * (0.25 + 0.25 * tube) + 9 * std::sin(0.05 * x + tube);
        const double across = (y - centre) / (1.0 + 0.7 * tube);
        grey -= 0.25 * std::exp(-0.5 * across * across);
      }
      image.pixels.push_back(std::round(least + span * std::clamp(grey + normal(random), 0.0, 1.0)));
    }
  }
  return image;
}

}  // namespace tubed
