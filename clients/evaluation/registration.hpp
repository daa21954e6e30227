// How far tubes lie from the projected truth, image by image: which form of the image likelihood finds them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// One way from coils and image to a shape, by the name that is printed.
struct RegistrationMethod {
  std::string name;
  EstimatorSettings settings;
};

/// Each form of the image likelihood in mode joint, and the paper's own alternation begun at the coils'
/// projection.
std::vector<RegistrationMethod> registration_methods();

/// How far the estimated tube of one image lies from the projected truth.
struct RegisteredImage {
  std::uint32_t frame = 0;
  std::string camera;
  Validity validity = Validity::kNotAvailable;
  Reasons reasons;
  float agreeing = 0;               ///< share of the lines in view that agree with the shape
  std::vector<double> distance_px;  ///< of its points every mm that lie inside the image; never empty
  double width_px = 0;              ///< of the true tube's projection, median
};

/// Every image by itself, from the coils of its instant: the estimator forgets before each. A row for each
/// image that was measured and shows part of the true tube and of the estimated one. Throws
/// std::runtime_error for a sequence without truth, SequenceError for an image that cannot be read.
std::vector<RegisteredImage> register_images(const Sequence& sequence, const EstimatorSettings& settings,
                                             const FrangiSettings& frangi);

/// Farther off than this at a twentieth of its points, and outside of the true tube's picture, a tube lies on
/// something else, px.
inline constexpr double kCaptured_px = 3.0;

/// Over all points of all images. Nothing but zeros without images.
struct RegistrationSummary {
  std::size_t images = 0;
  double median_px = 0;
  double p95_px = 0;
  std::size_t captured = 0;  ///< images whose 95th percentile is beyond kCaptured_px and half of the width
  std::size_t flagged = 0;   ///< of those, with another validity than VALID
};
RegistrationSummary summary_of(const std::vector<RegisteredImage>& images);

/// A row an image, the farthest off first, at most `max_rows` of them.
std::string table_of(std::vector<RegisteredImage> images, std::size_t max_rows);

}  // namespace tubed
