// The forms that the image likelihood can have, by name.
#pragma once

#include <optional>
#include <string_view>

namespace tubed {

/// What speaks for the tube.
enum class ImageLikelihoodForm {
  kVesselness,  ///< "vesselness": its height on each line, and a chain over the lines
  kPosterior,   ///< "posterior": P(tube | y) by histograms over y, on each line, and the same chain
  kBand,        ///< "band": Eq. (16) over all pixels near the tube, each line for itself
};

std::string_view name_of(ImageLikelihoodForm form);

/// The form of that name; nothing for another word.
std::optional<ImageLikelihoodForm> image_likelihood_named(std::string_view name);

}  // namespace tubed
