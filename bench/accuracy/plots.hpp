// Pictures of the errors: box plots as the paper's Fig. 5, errors over time, and sensitivity curves.
#pragma once

#include <string>
#include <vector>

#include "clients/evaluation/evaluation.hpp"

namespace tubed {

/// Two groups as in Fig. 5.
struct BoxPair {
  std::string em_name;
  std::string fused_name;
  const MethodEvaluation* em = nullptr;
  const MethodEvaluation* fused = nullptr;
};

/// Boxes from quartile to quartile with the median, whiskers to the least and greatest error, over each pair
/// of boxes the improvement (median | IQR), %. One row of metrics a pair.
std::string box_plots(const std::string& title, const std::vector<BoxPair>& pairs);

/// One curve of errors over the instants of a sequence.
struct ErrorCurve {
  std::string name;
  const MethodEvaluation* evaluation = nullptr;
};

/// Panels of RMS and of the RMS along x and z. `t_s`: times of the instants.
std::string error_over_time(const std::string& title, const std::vector<double>& t_s,
                            const std::vector<ErrorCurve>& curves);

/// One curve of a sensitivity study: median error of a method against what was varied.
struct SensitivityCurve {
  std::string name;
  std::vector<double> values;    ///< of what was varied
  std::vector<double> error_mm;  ///< median RMS
  std::vector<double> tip_told;  ///< share of instants whose tip is within three sigma on every axis
};
struct SensitivityPanel {
  std::string varied;  ///< with unit
  std::vector<SensitivityCurve> curves;
};

/// One panel each.
std::string sensitivity_plots(const std::string& title, const std::vector<SensitivityPanel>& panels);

}  // namespace tubed
