#include "drivers/laboratory/fluoroscope/dicom/ct_series.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/laboratory/fluoroscope/dicom/ct_slice.hpp"

namespace tubed {

namespace {

std::vector<CtSlice> read_slices(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    throw CtSeriesError("CT series: " + folder.string() +
                        " is no folder; give the one that holds the .dcm files");
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) {
    throw CtSeriesError("CT series: " + folder.string() + " is empty; put the slices of one CT series there");
  }
  std::sort(files.begin(), files.end());
  std::vector<CtSlice> slices;
  for (const auto& file : files) {
    if (auto slice = read_ct_slice(file)) {
      slices.push_back(std::move(*slice));
    }
  }
  if (slices.empty()) {
    throw CtSeriesError("CT series: none of the " + std::to_string(files.size()) + " files in " +
                        folder.string() + " is a DICOM file");
  }
  return slices;
}

void check_same_series(const std::vector<CtSlice>& slices) {
  const CtSlice& first = slices.front();
  for (const CtSlice& slice : slices) {
    const std::string both = first.file.string() + " and " + slice.file.string();
    if (slice.series != first.series) {
      throw CtSeriesError("CT series: " + both + " are of two series (" + first.series + " and " +
                          slice.series + "); leave one in the folder");
    }
    if (slice.columns != first.columns || slice.rows != first.rows ||
        (slice.spacing_mm - first.spacing_mm).norm() > 1e-4 * first.spacing_mm.norm()) {
      throw CtSeriesError("CT series: " + both + " have pixels of different number or size");
    }
    if ((slice.along_row - first.along_row).norm() > 1e-3 ||
        (slice.along_column - first.along_column).norm() > 1e-3) {
      throw CtSeriesError("CT series: " + both + " are not parallel (a scout view?)");
    }
  }
}

/// Sorts along the normal; gives the distance from slice to slice.
double order_slices(std::vector<CtSlice>& slices) {
  const Eigen::Vector3d normal = slices.front().normal();
  const auto height = [&](const CtSlice& slice) { return normal.dot(slice.first_voxel_mm); };
  std::sort(slices.begin(), slices.end(),
            [&](const auto& a, const auto& b) { return height(a) < height(b); });
  if (slices.size() < 2) {
    throw CtSeriesError("CT series: only one slice (" + slices.front().file.string() +
                        "); a volume needs two or more");
  }
  // The commonest step, so that one gap does not spoil it.
  std::vector<double> steps;
  for (std::size_t i = 1; i < slices.size(); ++i) {
    steps.push_back(height(slices[i]) - height(slices[i - 1]));
  }
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double step_mm = sorted[sorted.size() / 2];
  const double across_mm = slices.front().spacing_mm.maxCoeff();
  if (step_mm > 1e-6 && (step_mm < 0.02 || step_mm > 50 || step_mm < across_mm / 100)) {
    std::ostringstream why;
    why << "CT series: slices are " << step_mm << " apart and their pixels " << across_mm
        << "; DICOM wants both in mm (are some of them metres?)";
    throw CtSeriesError(why.str());
  }
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (std::abs(steps[i] - step_mm) > 0.05 * step_mm || steps[i] <= 1e-6) {
      std::ostringstream why;
      why << "CT series: " << slices[i].file.string() << " and " << slices[i + 1].file.string() << " are "
          << steps[i] << " mm apart, other slices " << step_mm << " mm; is a slice missing or doubled?";
      throw CtSeriesError(why.str());
    }
    const Eigen::Vector3d shift = slices[i + 1].first_voxel_mm - slices[i].first_voxel_mm - steps[i] * normal;
    if (shift.norm() > 0.05 * across_mm + 0.02 * step_mm) {
      throw CtSeriesError("CT series: " + slices[i + 1].file.string() +
                          " is shifted sideways against the slice before it (a tilted gantry?)");
    }
  }
  return (height(slices.back()) - height(slices.front())) / static_cast<double>(steps.size());
}

}  // namespace

AttenuationVolume read_ct_series(const std::filesystem::path& folder, const CtSeriesSettings& settings) {
  std::vector<CtSlice> slices = read_slices(folder);
  check_same_series(slices);
  const double step_mm = order_slices(slices);
  const CtSlice& first = slices.front();

  RigidTransform T_patient_volume = RigidTransform::Identity();
  T_patient_volume.linear().col(0) = first.along_row.normalized();
  T_patient_volume.linear().col(2) = first.normal();
  T_patient_volume.linear().col(1) = first.normal().cross(first.along_row).normalized();
  T_patient_volume.translation() = first.first_voxel_mm;
  AttenuationVolume volume({first.columns, first.rows, static_cast<int>(slices.size())},
                           {first.spacing_mm.x(), first.spacing_mm.y(), step_mm},
                           settings.T_room_patient * T_patient_volume);
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const float* hounsfield = slices[k].hounsfield.data();
    for (int j = 0; j < first.rows; ++j) {
      for (int i = 0; i < first.columns; ++i, ++hounsfield) {
        volume.set(i, j, static_cast<int>(k),
                   static_cast<float>(settings.water_attenuation_per_mm) * (1 + *hounsfield / 1000));
      }
    }
  }
  return volume;
}

}  // namespace tubed
