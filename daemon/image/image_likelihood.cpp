#include "daemon/image/image_likelihood.hpp"

#include "daemon/image/appearance_lines.hpp"

namespace tubed {

namespace {

class VesselnessLikelihood final : public ImageLikelihood {
 public:
  LineSearch::Outcome find(const ImageMeasurement& image, CorrespondenceLines& lines, int count, int reach_px,
                           LineSearch::Among among) override {
    return search_.search(image, lines, count, reach_px, kLineTransition_px, among);
  }

 private:
  LineSearch search_;
};

}  // namespace

std::string_view name_of(ImageLikelihoodForm form) {
  for (const auto& [named, name] : kImageLikelihoodForms) {
    if (named == form) return name;
  }
  return "";
}

std::optional<ImageLikelihoodForm> image_likelihood_named(std::string_view name) {
  for (const auto& [form, known] : kImageLikelihoodForms) {
    if (known == name) return form;
  }
  return std::nullopt;
}

std::unique_ptr<ImageLikelihood> make_image_likelihood(ImageLikelihoodForm form) {
  switch (form) {
    case ImageLikelihoodForm::kPosterior:
      return std::make_unique<PosteriorLikelihood>();
    case ImageLikelihoodForm::kBand:
      return std::make_unique<BandPixelLikelihood>();
    case ImageLikelihoodForm::kVesselness:
      break;
  }
  return std::make_unique<VesselnessLikelihood>();
}

}  // namespace tubed
