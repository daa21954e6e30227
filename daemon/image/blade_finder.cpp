#include "daemon/image/blade_finder.hpp"

#include <algorithm>

namespace tubed {

namespace {

constexpr float kFlatShare =
    0.2F;  // of what nine tenths of the 3 x 3 reduced pixels spread less than: a blade is flatter
constexpr float kMinFlatSpread = 0.01F;    // grey levels of 255
constexpr std::size_t kSpreadStride = 17;  // every so many-th reduced pixel is looked at
constexpr Eigen::Index kMargin = 2;        // reduced px around a blade that its edge still touches

void shut_where_shut(const std::uint8_t* other, Eigen::Index count, std::uint8_t* open) {
  for (Eigen::Index i = 0; i < count; ++i) open[i] = open[i] & other[i];
}

}  // namespace

BladeFinder::BladeFinder(Eigen::Index rows, Eigen::Index columns)
    : spread_(PixelGrid::Zero(rows, columns)),
      greatest_(columns),
      least_(columns),
      between_(OpenGrid::Ones(rows, columns)) {
  queue_.reserve(static_cast<std::size_t>(spread_.size()));
  some_spreads_.reserve(static_cast<std::size_t>(spread_.size()) / kSpreadStride + 1);
}

void BladeFinder::find(const PixelGrid& grey, OpenGrid& open) {
  measure_spread(grey);
  open.setOnes();
  shut_flat_from_border(open);
  if (!queue_.empty()) shut_margin(open);
}

void BladeFinder::measure_spread(const PixelGrid& grey) {
  const Eigen::Index h = grey.rows() - 2;
  const Eigen::Index w = grey.cols() - 2;
  for (Eigen::Index row = 1; row <= h; ++row) {
    greatest_ = grey.row(row - 1).max(grey.row(row)).max(grey.row(row + 1));
    least_ = grey.row(row - 1).min(grey.row(row)).min(grey.row(row + 1));
    spread_.row(row).segment(1, w) =
        greatest_.segment(0, w).max(greatest_.segment(1, w)).max(greatest_.segment(2, w)) -
        least_.segment(0, w).min(least_.segment(1, w)).min(least_.segment(2, w));
  }
  spread_.col(0) = spread_.col(1);
  spread_.col(w + 1) = spread_.col(w);
  spread_.row(0) = spread_.row(1);
  spread_.row(h + 1) = spread_.row(h);
}

/// Grey levels: what spreads less is flat.
float BladeFinder::flat_spread() {
  some_spreads_.clear();
  for (std::size_t i = 0; i < static_cast<std::size_t>(spread_.size()); i += kSpreadStride) {
    some_spreads_.push_back(spread_.data()[i]);
  }
  const auto high = some_spreads_.begin() + static_cast<std::ptrdiff_t>(some_spreads_.size() * 9 / 10);
  std::nth_element(some_spreads_.begin(), high, some_spreads_.end());
  return std::max(kMinFlatSpread, kFlatShare * *high);
}

void BladeFinder::shut_flat_from_border(OpenGrid& open) {
  const float flat = flat_spread();
  const Eigen::Index columns = open.cols();
  const Eigen::Index last_row = open.rows() - 1;
  const Eigen::Index last_column = columns - 1;
  queue_.clear();
  const auto shut = [&](Eigen::Index place) {
    if (spread_.data()[place] <= flat && open.data()[place] != 0) {
      open.data()[place] = 0;
      queue_.push_back(static_cast<std::int32_t>(place));
    }
  };
  for (Eigen::Index column = 0; column <= last_column; ++column) {
    shut(column);
    shut(last_row * columns + column);
  }
  for (Eigen::Index row = 0; row <= last_row; ++row) {
    shut(row * columns);
    shut(row * columns + last_column);
  }
  for (std::size_t next = 0; next < queue_.size(); ++next) {
    const Eigen::Index place = queue_[next];
    const Eigen::Index column = place % columns;
    if (place >= columns) shut(place - columns);
    if (place < last_row * columns) shut(place + columns);
    if (column > 0) shut(place - 1);
    if (column < last_column) shut(place + 1);
  }
}

/// A square of 2 kMargin + 1 pixels, first along columns, then along rows.
void BladeFinder::shut_margin(OpenGrid& open) {
  const Eigen::Index columns = open.cols();
  between_ = open;
  for (Eigen::Index by = columns; by <= kMargin * columns; by += columns) {
    shut_where_shut(open.data() + by, open.size() - by, between_.data());
    shut_where_shut(open.data(), open.size() - by, between_.data() + by);
  }
  open = between_;
  for (Eigen::Index row = 0; row < open.rows(); ++row) {
    for (Eigen::Index by = 1; by <= kMargin; ++by) {
      shut_where_shut(&between_(row, by), columns - by, &open(row, 0));
      shut_where_shut(&between_(row, 0), columns - by, &open(row, by));
    }
  }
}

}  // namespace tubed
