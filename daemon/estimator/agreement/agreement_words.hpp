// What coils and images disagree about, for a person.
#pragma once

#include <array>
#include <span>
#include <string>

#include "drivers/interface/room.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// Writes one sentence, zero-terminated and cut to the size of `text`: whose shape, what explains it best and
/// by how much, and what to do. Its explanation must not be Discord::kNone. Never allocates.
void write_disagreement(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                        std::span<const CameraCalibration> cameras, std::span<char> text);

/// The same of marks that the instrument has, and that images do not show.
void write_missing_marks(const InstrumentDescription& instrument, std::span<char> text);

/// The same of coils that have all jumped by so much (CommonJump).
void write_common_jump(const InstrumentDescription& instrument, double jump_mm, std::span<char> text);

/// What explains it best and by how much, and what to do, without the beginning of that sentence. Allocates.
std::string explanation_of(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                           std::span<const CameraCalibration> cameras);

/// Length of a shift in mm, angle of a rotation vector in rad.
double length_of(const std::array<float, 3>& vector);

/// One line for a person, also where nothing has to be explained: what was seen to be off, and how probable
/// it is that everything is as stated. A coil's sensor number is left out where `instrument` has none.
/// Allocates.
std::string describe_agreement(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                               std::span<const CameraCalibration> cameras);

}  // namespace tubed
