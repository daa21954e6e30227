// The rest shape of a tip from a drawing of it: arcs through points along the middle of the catheter.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/calibration/configuration_fragment.hpp"
#include "drivers/interface/rest_curve.hpp"

namespace tubed {

/// Points along the middle of a catheter that lies flat and that nothing bends, tip first, mm; 2 x n.
struct TracedTip {
  std::string source;  ///< what they were read from
  Eigen::Matrix2Xd points_mm;
};

/// Reads a CSV file with the columns x_mm and y_mm, or, with `mm_per_px` > 0, x_px and y_px of a photograph.
/// Throws SequenceError for a file that cannot be read, CalibrationError for points that are no drawing:
/// fewer than 8, further than 15 mm apart, a corner of more than 100 degrees, lengths that no tip has, a
/// column z_mm, z_px or z by which they do not lie in one plane.
TracedTip read_traced_tip(const std::filesystem::path& file, double mm_per_px);

/// Arcs through a drawing.
struct TracedCurve {
  RestCurve curve;      ///< lengths and radii to a tenth of a millimetre; the first bent arc turns positively
  double rms_mm = 0;    ///< of the drawn points, across the curve
  double max_mm = 0;    ///< the same, greatest
  double drawn_mm = 0;  ///< how much of the catheter the drawing shows
  double shaft_mm = 0;  ///< how much of that is straight, behind the last arc
  bool ends_bent = false;    ///< the last arc goes to the drawing's end: there may be more of it
  Eigen::Matrix2Xd line_mm;  ///< the curve, laid over the points; a point every half millimetre
};

/// The fewest arcs that explain the points: begins with pieces of 3 mm or more, merges neighbours as long as
/// the criterion n ln(SSE / (n - k)) + 1.5 k ln n falls (Bayes' is the one with 1 instead of 1.5; k numbers),
/// and then moves their ends; each time the squared distances of the points across the curve are least
/// (Gauss-Newton). A piece that turns by less than 3 degrees or has a radius of more than 200 mm is straight.
/// Throws CalibrationError for a drawing that is straight, and for arcs that no configuration takes.
TracedCurve fit_arcs(const TracedTip& drawing);

/// What a person should look at again before these arcs are used, a sentence without its stop each.
std::vector<std::string> doubts_of(const TracedCurve& found);

/// rest_shape and rest_arcs_mm of an instrument; as remarks the distances, then the doubts.
ConfigurationFragment fragment_of(const TracedCurve& found, const TracedTip& drawing,
                                  const std::string& instrument_id);

/// Points and arcs above each other, a table of the arcs; SVG.
std::string page_of(const TracedCurve& found, const TracedTip& drawing,
                    const ConfigurationFragment& fragment);

}  // namespace tubed
