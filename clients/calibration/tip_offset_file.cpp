#include "clients/calibration/tip_offset_file.hpp"

#include <toml++/toml.h>

#include <cmath>

#include "clients/calibration/formatted.hpp"
#include "clients/markers/marker_file.hpp"

namespace tubed {

namespace {

std::string place_of(const std::filesystem::path& file, const toml::source_position& at) {
  return file.string() + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) + ": ";
}

toml::table parsed(const std::filesystem::path& file) {
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& error) {
    if (error.source().begin.line == 0) throw MarkerFileError(file.string() + ": cannot be read");
    throw MarkerFileError(place_of(file, error.source().begin) + std::string(error.description()));
  }
}

}  // namespace

std::string tip_offset_text(const PivotCalibration& pivot, const std::string& date) {
  const auto three = [](const Eigen::Vector3d& v) {
    return formatted("[%.4f, %.4f, %.4f]", v.x(), v.y(), v.z());
  };
  return "# Tip of a probe in its sensor's frame, found by tubectl pivot; for tubectl register "
         "--tip-offset-file\n"
         "tip_offset_mm = " +
         three(pivot.tip_offset_mm) +
         "\nsigma_mm = " + three(pivot.covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt()) +
         formatted("\nresidual_mm = %.4f\ndegrees_of_freedom = %d\n", pivot.residual_mm,
                   static_cast<int>(pivot.freedom)) +
         "date = \"" + date + "\"\n";
}

Eigen::Vector3d read_tip_offset(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    throw MarkerFileError(file.string() + ": there is no such file");
  }
  const toml::table table = parsed(file);
  const toml::node* const node = table.get("tip_offset_mm");
  if (node == nullptr) {
    throw MarkerFileError(file.string() +
                          ": tip_offset_mm is missing; tubectl pivot --out writes such a file");
  }
  const std::string wrong =
      place_of(file, node->source().begin) + "tip_offset_mm: expected three finite numbers";
  const toml::array* const array = node->as_array();
  if (array == nullptr || array->size() != 3) throw MarkerFileError(wrong);
  Eigen::Vector3d offset_mm;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = array->get(i)->value<double>();
    if (!number || !std::isfinite(*number)) throw MarkerFileError(wrong);
    offset_mm(static_cast<Eigen::Index>(i)) = *number;
  }
  return offset_mm;
}

}  // namespace tubed
