// Samples as they may be shown: DDS checks the length of a text, not what is in it.
#pragma once

#include "idl/dds_contract.hpp"

namespace tubed {

/// Makes every text of a received sample printable where it stands (printable_text.hpp); what grows beyond
/// its place is cut between two characters. What a tubed sends stays as it is.
void make_printable(tubed_TubeEstimate& sample) noexcept;
void make_printable(tubed_EmSamples& sample) noexcept;
void make_printable(tubed_TubeStatus& sample) noexcept;
void make_printable(tubed_TubeIdentity& sample) noexcept;
void make_printable(tubed_TubeHealth& sample) noexcept;

}  // namespace tubed
