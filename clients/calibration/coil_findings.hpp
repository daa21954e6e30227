// What the calibration of coils found, as values of the configuration and as pages.
#pragma once

#include <string>
#include <vector>

#include "clients/calibration/arc_lengths.hpp"
#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/field_error.hpp"
#include "clients/calibration/moving_noise.hpp"
#include "clients/calibration/straight_catheter.hpp"
#include "clients/calibration/tracker_noise.hpp"

namespace tubed {

/// A measured shape never changes silently: a change of an arc length beyond this is warned of.
inline constexpr double kNotedChange_mm = 2;

/// Values of the coils that were found, with sigma where the tip is known; before and after as remarks.
ConfigurationFragment fragment_of(const StraightCatheter& found, const std::string& instrument_id);

/// What may be put into [estimator]: sigma is noise and the field's error together, so that noise alone
/// gives none. `field_axis_mm`: the field's, an axis; negative: not known.
ConfigurationFragment fragment_of(const StillNoise& noise, double field_axis_mm);
ConfigurationFragment fragment_of(const MovingNoise& noise, double field_axis_mm);

/// One page each, SVG.
std::string page_of(const StraightCatheter& found, const ConfigurationFragment& fragment);
std::string page_of(const StillNoise& noise, const FieldError* field, const ConfigurationFragment& fragment);
std::string page_of(const MovingNoise& noise, const FieldError* field, const ConfigurationFragment& fragment);

}  // namespace tubed
