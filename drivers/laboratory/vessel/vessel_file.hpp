// A vessel of the user's own, from a file.
#pragma once

#include <filesystem>

#include "drivers/laboratory/vessel/vessel.hpp"

namespace tubed {

/// Reads a vessel. World frame, mm. By the name's ending:
///
/// `.csv`: columns x, y, z, radius (any order, a header line): the centreline with radii, from the introducer
/// to the target, at most 10 mm between two rows. The first 5 mm may not bend: the catheter comes in
/// straight.
///
/// `.stl`, ASCII or binary: the closed surface of one lumen without branches that meet again. It has to be
/// watertight (each edge belongs to two triangles that run along it in opposite directions) and of one piece.
/// The route is found inside, between the two places that are furthest apart; the catheter comes in at the
/// lower (smaller z) one.
///
/// Throws std::invalid_argument with file, line where there is one, what is wrong and what to do: unreadable,
/// broken, open or torn surfaces, more than one piece, sizes that mean another unit (longest extent under 30
/// mm or above 2000 mm), lumens narrower than the catheter, kinks.
Vessel read_vessel(const std::filesystem::path& file);

}  // namespace tubed
