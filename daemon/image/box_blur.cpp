#include "daemon/image/box_blur.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tubed {

namespace {

/// Windows of 2 r + 1 pixels, three times: variance 3 ((2 r + 1)^2 - 1) / 12.
int radius_for(double sigma_px) {
  return std::max(1, static_cast<int>(std::lround((std::sqrt(4 * sigma_px * sigma_px + 1) - 1) / 2)));
}

using Four [[gnu::vector_size(16)]] = float;

Four load(const float* from) {
  Four values;
  std::memcpy(&values, from, sizeof values);
  return values;
}

void store(const Four& values, float* to) { std::memcpy(to, &values, sizeof values); }

/// Four rows of four, which are the columns then. Steps: from row to row.
void transpose_4x4(const float* from, Eigen::Index from_step, float* to, Eigen::Index to_step) {
  const Four a = load(from);
  const Four b = load(from + from_step);
  const Four c = load(from + 2 * from_step);
  const Four d = load(from + 3 * from_step);
  const Four low_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Four low_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Four high_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Four high_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  store(__builtin_shufflevector(low_ab, low_cd, 0, 1, 4, 5), to);
  store(__builtin_shufflevector(low_ab, low_cd, 2, 3, 6, 7), to + to_step);
  store(__builtin_shufflevector(high_ab, high_cd, 0, 1, 4, 5), to + 2 * to_step);
  store(__builtin_shufflevector(high_ab, high_cd, 2, 3, 6, 7), to + 3 * to_step);
}

/// `rows` x `columns` values become `columns` x `rows`. Steps: from row to row.
void transpose(const float* from, Eigen::Index from_step, Eigen::Index rows, Eigen::Index columns, float* to,
               Eigen::Index to_step) {
  const Eigen::Index whole_rows = rows / 4 * 4;
  const Eigen::Index whole_columns = columns / 4 * 4;
  for (Eigen::Index row = 0; row < whole_rows; row += 4) {
    for (Eigen::Index column = 0; column < whole_columns; column += 4) {
      transpose_4x4(from + row * from_step + column, from_step, to + column * to_step + row, to_step);
    }
  }
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index column = row < whole_rows ? whole_columns : 0; column < columns; ++column) {
      to[column * to_step + row] = from[row * from_step + column];
    }
  }
}

}  // namespace

BoxBlur::Strip::Strip(Eigen::Index length, int radius)
    : length_(length),
      radius_(radius),
      before_((radius_ + 1) * kLanes),
      even_(static_cast<std::size_t>((length + 2 * radius_ + 1) * kLanes)),
      odd_(even_) {}

const float* BoxBlur::Strip::blur() {
  sum_windows(even_.data(), odd_.data());
  sum_windows(odd_.data(), even_.data());
  sum_windows(even_.data(), odd_.data());
  return odd_.data() + before_;
}

void BoxBlur::Strip::sum_windows(const float* from, float* to) const {
  Four s0{};
  Four s1{};
  Four s2{};
  Four s3{};
  const float* added = from + before_;
  for (Eigen::Index i = 0; i < radius_; ++i, added += kLanes) {
    s0 += load(added);
    s1 += load(added + 4);
    s2 += load(added + 8);
    s3 += load(added + 12);
  }
  const float* taken = from;
  float* sum = to + before_;
  for (Eigen::Index i = 0; i < length_; ++i, added += kLanes, taken += kLanes, sum += kLanes) {
    s0 += load(added) - load(taken);
    s1 += load(added + 4) - load(taken + 4);
    s2 += load(added + 8) - load(taken + 8);
    s3 += load(added + 12) - load(taken + 12);
    store(s0, sum);
    store(s1, sum + 4);
    store(s2, sum + 8);
    store(s3, sum + 12);
  }
}

BoxBlur::BoxBlur(Eigen::Index rows, Eigen::Index columns, double sigma_px)
    : share_(static_cast<float>(std::pow(2 * radius_for(sigma_px) + 1, -3))),
      down_(rows, radius_for(sigma_px)),
      across_(columns, radius_for(sigma_px)) {}

void BoxBlur::apply(PixelGrid& values) {
  for (Eigen::Index column = 0; column < values.cols(); column += Strip::kLanes) blur_columns(values, column);
  for (Eigen::Index row = 0; row < values.rows(); row += Strip::kLanes) blur_rows(values, row);
}

void BoxBlur::blur_columns(PixelGrid& values, Eigen::Index first) {
  const Eigen::Index lanes = std::min(Strip::kLanes, values.cols() - first);
  const Eigen::Index step = values.cols();
  float* place = values.data() + first;
  float* to = down_.values();
  for (Eigen::Index row = 0; row < values.rows(); ++row, to += Strip::kLanes) {
    std::copy_n(place + row * step, lanes, to);
  }
  const float* from = down_.blur();
  for (Eigen::Index row = 0; row < values.rows(); ++row, from += Strip::kLanes) {
    for (Eigen::Index lane = 0; lane < lanes; ++lane) place[row * step + lane] = share_ * from[lane];
  }
}

void BoxBlur::blur_rows(PixelGrid& values, Eigen::Index first) {
  const Eigen::Index lanes = std::min(Strip::kLanes, values.rows() - first);
  const Eigen::Index columns = values.cols();
  float* const place = values.data() + first * columns;
  transpose(place, columns, lanes, columns, across_.values(), Strip::kLanes);
  transpose(across_.blur(), Strip::kLanes, columns, lanes, place, columns);
  values.middleRows(first, lanes) *= share_;
}

}  // namespace tubed
