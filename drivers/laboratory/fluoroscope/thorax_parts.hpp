// The parts that make_thorax() paints, one after the other.
#pragma once

#include "drivers/laboratory/fluoroscope/thorax.hpp"
#include "drivers/laboratory/fluoroscope/tissue_texture.hpp"
#include "drivers/laboratory/fluoroscope/volume_painter.hpp"

namespace tubed {

/// Skin, fat, muscle, lungs, mediastinum, liver and gut: every voxel of the body.
void paint_soft_tissue(AttenuationVolume& volume, const TissueTexture& texture);
/// Gas in stomach and colon.
void paint_gas(VolumePainter& painter, std::int64_t seed);
/// Heart, great vessels, the aorta, airways.
void paint_heart(VolumePainter& painter, const TissueTexture& texture);
void paint_great_vessels(VolumePainter& painter, const VesselCourse& aorta);
void paint_airways(VolumePainter& painter);
/// The tree of arteries and veins in both lungs.
void paint_lung_vessels(VolumePainter& painter, std::int64_t seed);
void paint_spine(VolumePainter& painter, const TissueTexture& texture);
void paint_ribs(VolumePainter& painter);
void paint_sternum_and_girdle(VolumePainter& painter);

}  // namespace tubed
