// Options of mode "paper": what the equations leave open, and each place where the default departs from their
// print. The effect of each is in daemon/estimator/paper/README.md.
#pragma once

#include "idl/settings/bound_key.hpp"

namespace tubed {

/// Weights of the terms of Eq. (12) and (14).
enum class PaperWeights {
  kConsistent,  ///< each term divided by the variance of what it measures
  kPrinted,     ///< all 1, whatever the unit
};

/// The sum over lengths of Eq. (12) in the depth-only step of Sec. 2.2.3.
enum class PaperDepthLengths {
  kLeftOut,  ///< what the image changed of the length in its plane is not made good in depth
  kPrinted,
};

/// Where the search of Eq. (18) begins.
enum class PaperMleStart {
  kLines,  ///< at the ridge that correspondence lines find around the projection of the EM shape
  kEm,     ///< at the projection of the EM shape
};

/// What holds knot points that no pixel holds.
enum class PaperMlePrior {
  kEmError,  ///< they move as errors of the coils do: little, and with their neighbours
  kNone,     ///< nothing
};

/// What Eq. (16) takes the pixels behind the hub end of the tube's length for.
enum class PaperHubEnd {
  kGoesOn,  ///< nothing: the catheter goes on there
  kCapped,  ///< background
};

/// epsilon of Eq. (17) during one search.
enum class PaperHeaviside {
  kNarrowing,  ///< wide first, heaviside_px at last
  kFixed,      ///< heaviside_px
};

struct PaperSettings {
  int knot_point_count = 20;  ///< Sec. 3.4; 4 .. 48
  PaperWeights weights = PaperWeights::kConsistent;
  double sigma_length_mm = 0.2;  ///< of the length between two coils
  PaperDepthLengths depth_lengths = PaperDepthLengths::kLeftOut;
  PaperMleStart mle_start = PaperMleStart::kLines;
  PaperMlePrior mle_prior = PaperMlePrior::kEmError;
  PaperHubEnd hub_end = PaperHubEnd::kGoesOn;
  PaperHeaviside heaviside = PaperHeaviside::kFixed;
  double heaviside_px = 1.5;       ///< epsilon of Eq. (17)
  double appearance_share = 0.05;  ///< of a trusted image in the appearance model; 0: never adapts
  int rounds = 6;                  ///< of MLE and depth-only MAP, at most
};

/// The keys of [estimator.paper].
inline BoundKeys<PaperSettings> paper_keys() {
  using S = PaperSettings;
  return {
      key::number("knot_point_count", &S::knot_point_count, "", {4, 48}, "knot points of the tube"),
      key::word("weights", &S::weights,
                {{PaperWeights::kConsistent, "consistent"}, {PaperWeights::kPrinted, "printed"}},
                "of the terms of Eq. (14): by their variances, or all 1 as printed"),
      key::number("sigma_length_mm", &S::sigma_length_mm, "mm", {0.001, 50},
                  "standard deviation of the length between two coils"),
      key::word("depth_lengths", &S::depth_lengths,
                {{PaperDepthLengths::kLeftOut, "left_out"}, {PaperDepthLengths::kPrinted, "printed"}},
                "the lengths of Eq. (12) in the depth-only step"),
      key::word("mle_start", &S::mle_start, {{PaperMleStart::kLines, "lines"}, {PaperMleStart::kEm, "em"}},
                "where Eq. (18) begins: at the nearest ridge, or at the coils' own projection"),
      key::word("mle_prior", &S::mle_prior,
                {{PaperMlePrior::kEmError, "em_error"}, {PaperMlePrior::kNone, "none"}},
                "what holds the tube where no pixel does: the coils' error, or nothing"),
      key::word("hub_end", &S::hub_end, {{PaperHubEnd::kGoesOn, "goes_on"}, {PaperHubEnd::kCapped, "capped"}},
                "whether the catheter goes on behind length_mm or the tube ends there"),
      key::word("heaviside", &S::heaviside,
                {{PaperHeaviside::kNarrowing, "narrowing"}, {PaperHeaviside::kFixed, "fixed"}},
                "epsilon of Eq. (17): wide first, or always heaviside_px"),
      key::number("heaviside_px", &S::heaviside_px, "px", {0.5, 20}, "epsilon of Eq. (17)"),
      key::number("appearance_share", &S::appearance_share, "", {0, 1},
                  "of a trusted image in the appearance of tube and background"),
      key::number("rounds", &S::rounds, "", {1, 50}, "of image and depth in turn, at most")};
}

}  // namespace tubed
