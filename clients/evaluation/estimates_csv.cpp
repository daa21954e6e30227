#include "clients/evaluation/estimates_csv.hpp"

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "drivers/csv/csv_reader.hpp"

namespace tubed {

namespace {

enum Column : std::size_t { kFrame, kS, kX, kY, kZ, kSigmaX, kSigmaY, kSigmaZ, kValidity, kCovariance };
constexpr std::size_t kCovariances = 6;
constexpr std::size_t kHeldBy = kCovariance + kCovariances;

/// s_mm x y z sigma_x sigma_y sigma_z, then xx xy xz yy yz zz of the covariance.
struct Row {
  std::array<double, 7 + kCovariances> numbers{};
  std::uint32_t held_by = 0;
};

Validity validity_of(const CsvReader& csv) {
  for (const Validity validity :
       {Validity::kNotAvailable, Validity::kValid, Validity::kQuestionable, Validity::kInvalid}) {
    if (csv.text(kValidity) == name_of(validity)) return validity;
  }
  csv.refuse(kValidity,
             in_quotes(csv.text(kValidity)) + " is none of NOT_AVAILABLE, VALID, QUESTIONABLE, INVALID");
}

bool has_no_shape(const CsvReader& csv) {
  for (std::size_t column = kS; column < kValidity; ++column) {
    if (!csv.is_empty(column)) return false;
  }
  return true;
}

bool has_covariances(const CsvReader& csv) {
  for (std::size_t i = 0; i < kCovariances; ++i) {
    if (!csv.has(kCovariance + i)) return false;
  }
  return true;
}

Row row_of(const CsvReader& csv) {
  Row row;
  for (std::size_t column = kS; column < kSigmaX; ++column) row.numbers[column - kS] = csv.number(column);
  for (std::size_t column = kSigmaX; column < kValidity; ++column) {
    row.numbers[column - kS] = csv.number_or_infinity(column);
    if (row.numbers[column - kS] < 0) csv.refuse(column, "a standard deviation cannot be negative");
  }
  for (std::size_t i = 0; i < kCovariances && has_covariances(csv); ++i) {
    row.numbers[7 + i] = csv.number_or_infinity(kCovariance + i);
  }
  if (csv.has(kHeldBy)) {
    row.held_by = csv.count(kHeldBy);
    if (row.held_by > (kHeldByCoil | kHeldByImage)) {
      csv.refuse(kHeldBy, "0: nothing, 1: a coil, 2: an image, 3: both; there is no other");
    }
  }
  return row;
}

EstimatedShape shape_of(Validity validity, const std::vector<Row>& rows, const CsvReader& csv) {
  const bool covariances_known = has_covariances(csv);
  EstimatedShape shape;
  shape.validity = validity;
  const auto count = static_cast<Eigen::Index>(rows.size());
  shape.centreline.p_world_mm.resize(3, count);
  shape.sigma_world_mm.resize(3, count);
  shape.covariance_world_mm2.resize(6, covariances_known ? count : 0);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& row = rows[static_cast<std::size_t>(i)].numbers;
    shape.centreline.s_mm.push_back(row[0]);
    shape.centreline.p_world_mm.col(i) << row[1], row[2], row[3];
    shape.sigma_world_mm.col(i) << row[4], row[5], row[6];
    if (covariances_known) {
      shape.covariance_world_mm2.col(i) << row[7], row[8], row[9], row[10], row[11], row[12];
    }
    if (csv.has(kHeldBy)) shape.held_by.push_back(rows[static_cast<std::size_t>(i)].held_by);
  }
  return shape;
}

}  // namespace

Eigen::Matrix3d symmetric(const Eigen::Ref<const Eigen::VectorXd>& upper_triangle) {
  const auto& c = upper_triangle;
  Eigen::Matrix3d matrix;
  matrix << c[0], c[1], c[2],  //
      c[1], c[3], c[4],        //
      c[2], c[4], c[5];
  return matrix;
}

Estimates read_estimates(const std::filesystem::path& file) {
  CsvReader csv(file, {"frame", "s_mm", "x", "y", "z", "sigma_x", "sigma_y", "sigma_z", "validity"},
                {"cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz", "held_by"});
  Estimates estimates;
  std::vector<Row> rows;  // of the frame that is being read
  bool more = csv.next_row();
  if (!more) throw SequenceError({file, 1, 1}, "there are no estimates after the header");
  while (more) {
    const std::uint32_t frame = csv.count(kFrame);
    const Validity validity = validity_of(csv);
    if (estimates.contains(frame))
      csv.refuse(kFrame, "the frame came before; its rows have to stand together");
    rows.clear();
    do {
      if (validity_of(csv) != validity)
        csv.refuse(kValidity, "one estimate has one validity, the row before another");
      if (!has_no_shape(csv)) {
        const Row row = row_of(csv);
        if (!rows.empty() && row.numbers[0] <= rows.back().numbers[0])
          csv.refuse(kS, "does not rise within the frame");
        rows.push_back(row);
      }
      more = csv.next_row();
    } while (more && csv.count(kFrame) == frame);
    estimates.emplace(frame, shape_of(validity, rows, csv));
  }
  return estimates;
}

}  // namespace tubed
