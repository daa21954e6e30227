// What coils and images disagree about, for a person.
#pragma once

#include <span>

#include "daemon/estimator/coil_image_agreement.hpp"

namespace tubed {

/// Writes one sentence, zero-terminated and cut to the size of `text`: whose shape, what explains it best and
/// by how much, and what to do. `verdict` must not be Discord::kNone. Never allocates.
void write_disagreement(const CoilImageAgreement::Verdict& verdict, const InstrumentDescription& instrument,
                        std::span<const CameraCalibration> cameras, std::span<char> text);

}  // namespace tubed
