// The forms that the image likelihood can have, by name.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "idl/settings/bound_key.hpp"

namespace tubed {

/// What speaks for the tube.
enum class ImageLikelihoodForm {
  kVesselness,  ///< "vesselness": its height on each line, and a chain over the lines
  kPosterior,   ///< "posterior": P(tube | y) by histograms over y, on each line, and the same chain
  kBand,        ///< "band": Eq. (16) over all pixels near the tube, each line for itself
};

/// All forms and their names.
inline constexpr std::array<NamedValue<ImageLikelihoodForm>, 3> kImageLikelihoodForms{
    {{ImageLikelihoodForm::kVesselness, "vesselness"},
     {ImageLikelihoodForm::kPosterior, "posterior"},
     {ImageLikelihoodForm::kBand, "band"}}};

std::string_view name_of(ImageLikelihoodForm form);

/// The form of that name; nothing for another word.
std::optional<ImageLikelihoodForm> image_likelihood_named(std::string_view name);

}  // namespace tubed
