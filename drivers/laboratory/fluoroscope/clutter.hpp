// What a fluoroscope sees beside patient and catheter: a ready-made set of it, and a catheter to look at.
#pragma once

#include "drivers/laboratory/fluoroscope/radiograph_scene.hpp"
#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"

namespace tubed {

/// Adds a guide wire that lies in the aorta and a pacing lead from the superior vena cava as second wire, and
/// three ECG leads with their clips on the chest, for the patient of make_thorax().
void add_default_clutter(RadiographSettings& settings);
/// Adds what an operation on the heart has left: six wires round the sternum of make_thorax(), clips along a
/// graft, and the lead of a defibrillator with its coil.
void add_surgery(RadiographSettings& settings);
/// Lets the contrast agent flow from the valve through `aorta` (given from its low end to the valve).
void add_lumen(RadiographSettings& settings, const VesselCourse& aorta);
/// Phases enough for smooth heart beat and breathing: some seconds at construction.
void add_motion(RadiographSettings& settings);

/// A 7 Fr catheter with four electrodes at its tip that lies along `vessel` (from its low end), its tip
/// `from_end_mm` before the vessel's end. Points about every mm, tip first.
RadiographRod catheter_along(const VesselCourse& vessel, double from_end_mm);

}  // namespace tubed
