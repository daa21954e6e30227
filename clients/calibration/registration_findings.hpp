// What may have gone wrong in a registration by markers, looked for one after the other, with the evidence.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/marker_registration.hpp"
#include "clients/calibration/report_page.hpp"

namespace tubed {

/// One thing that was looked at.
struct CalibrationFinding {
  std::string what;  ///< "units"
  ReportVerdict verdict = ReportVerdict::kGood;
  std::string evidence;  ///< with numbers
  std::string advice;    ///< what to do; empty where nothing has to be done
};

/// The worst of them; kGood of none.
ReportVerdict worst(const std::vector<CalibrationFinding>& findings);

/// Markers, their registration, and what is to be said of it.
struct JudgedRegistration {
  MarkerPairs pairs;
  MarkerRegistration registration;
  std::vector<LeftOut> left_out;      ///< as leave_one_out() returns it
  std::vector<std::size_t> outliers;  ///< markers that the others contradict, the worst first
  double outlier_limit_mm = 0;        ///< residual that one set in a hundred exceeds; 0: not judged
  std::vector<CalibrationFinding> findings;
};

/// Registers and judges, in the order in which mistakes hide each other: units, mirrored axes, exchanged
/// markers, scale, outliers; what is found to be wrong ends the search, as nothing after it can be judged.
/// Verdicts: kBad is a registration that must not be used, kDoubtful what a person should look at. `fle_mm`:
/// what is known of FLE beforehand; then residuals are held against it too. Throws MarkerFileError as
/// register_markers() does, and for markers so near a line that the turn about it has a standard deviation
/// beyond 2 degrees.
JudgedRegistration judge_registration(MarkerPairs pairs, std::optional<double> fle_mm = std::nullopt);

}  // namespace tubed
