#include "daemon/image/frangi_kernels.hpp"

#include <algorithm>

// This file is compiled once for each instruction set: Highway includes it again for every one.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "daemon/image/frangi_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tubed {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Words = hn::ScalableTag<std::uint16_t>;
using Integers = hn::ScalableTag<std::int32_t>;

// Columns that the horizontal pass of [begin, end) reads.
struct Reads {
  int begin;
  int end;
};
HWY_INLINE Reads reads_of(int begin, int end, int reach, int lanes) {
  // Not before the aligned column at or left of begin - reach; columns left of -1 need the division to floor.
  const int columns = begin - reach + 1;
  const int floored = (columns >= 0 ? columns : columns - lanes + 1) / lanes * lanes - 1;
  return {floored, end + reach};
}

// 2^t for t <= 0: the whole part goes to the exponent, the rest (-0.5 .. 0.5) through a polynomial; relative
// error below 3e-6 (least squares, reweighted to the least maximum). Adding 1.5 2^23 rounds to the nearest
// whole number.
template <class V>
HWY_INLINE V exp2_nonpositive(Floats d, V t) {
  const Integers di;
  const V magic = hn::Set(d, 12582912.0F);
  const V clamped = hn::Max(t, hn::Set(d, -120.0F));
  const V shifted = hn::Add(clamped, magic);
  const V rest = hn::Sub(clamped, hn::Sub(shifted, magic));
  V power = hn::MulAdd(hn::Set(d, 0.0095701F), rest, hn::Set(d, 0.05591786F));
  power = hn::MulAdd(power, rest, hn::Set(d, 0.24024745F));
  power = hn::MulAdd(power, rest, hn::Set(d, 0.69312181F));
  power = hn::MulAdd(power, rest, hn::Set(d, 0.99999926F));
  const auto exponent = hn::ShiftLeft<23>(hn::BitCast(di, shifted));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, power), exponent));
}

// Columns x .. x + 4 lanes - 1 of the sum over rows: four sums at once hide how long each addition takes.
HWY_INLINE void sum_of_rows(const SmoothFloatRow& task, int x) {
  const Floats d;
  const std::size_t n = hn::Lanes(d);
  const float* const* centre_row = task.rows + task.taps.reach;
  const float* centre = *centre_row + x;
  auto weight = hn::Set(d, task.taps.weights[0]);
  auto s0 = hn::Mul(weight, hn::LoadU(d, centre));
  auto s1 = hn::Mul(weight, hn::LoadU(d, centre + n));
  auto s2 = hn::Mul(weight, hn::LoadU(d, centre + 2 * n));
  auto s3 = hn::Mul(weight, hn::LoadU(d, centre + 3 * n));
  for (std::ptrdiff_t k = 1; k <= task.taps.reach; ++k) {
    const float* a = centre_row[-k] + x;
    const float* b = centre_row[k] + x;
    weight = hn::Set(d, task.taps.weights[k]);
    s0 = hn::MulAdd(weight, hn::Add(hn::LoadU(d, a), hn::LoadU(d, b)), s0);
    s1 = hn::MulAdd(weight, hn::Add(hn::LoadU(d, a + n), hn::LoadU(d, b + n)), s1);
    s2 = hn::MulAdd(weight, hn::Add(hn::LoadU(d, a + 2 * n), hn::LoadU(d, b + 2 * n)), s2);
    s3 = hn::MulAdd(weight, hn::Add(hn::LoadU(d, a + 3 * n), hn::LoadU(d, b + 3 * n)), s3);
  }
  hn::StoreU(s0, d, task.between + x);
  hn::StoreU(s1, d, task.between + x + n);
  hn::StoreU(s2, d, task.between + x + 2 * n);
  hn::StoreU(s3, d, task.between + x + 3 * n);
}

// Columns x .. x + 2 lanes - 1 of the sum along the row.
HWY_INLINE void sum_along_row(const SmoothFloatRow& task, int x) {
  const Floats d;
  const std::size_t n = hn::Lanes(d);
  const float* centre = task.between + x;
  auto weight = hn::Set(d, task.taps.weights[0]);
  auto s0 = hn::Mul(weight, hn::LoadU(d, centre));
  auto s1 = hn::Mul(weight, hn::LoadU(d, centre + n));
  const float* a = centre;
  const float* b = centre;
  for (int k = 1; k <= task.taps.reach; ++k) {
    --a;
    ++b;
    weight = hn::Set(d, task.taps.weights[k]);
    s0 = hn::MulAdd(weight, hn::Add(hn::LoadU(d, a), hn::LoadU(d, b)), s0);
    s1 = hn::MulAdd(weight, hn::Add(hn::LoadU(d, a + n), hn::LoadU(d, b + n)), s1);
  }
  hn::StoreU(s0, d, task.out + x);
  hn::StoreU(s1, d, task.out + x + n);
}

void smooth_float(const SmoothFloatRow& task) {
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  const Reads reads = reads_of(task.begin, task.end, task.taps.reach, lanes);
  for (int x = reads.begin; x < reads.end; x += 4 * lanes) {
    sum_of_rows(task, x);
  }
  for (int x = task.begin; x < task.end; x += 2 * lanes) {
    sum_along_row(task, x);
  }
}

// weight (a + b) / 65536 with twice the weight in `pair`, as 16 bits allow it.
template <class V>
HWY_INLINE V weighted_pair(V pair, V a, V b) {
  return hn::MulHigh(pair, hn::AverageRound(a, b));
}

// By way of memory: halves of registers have no name that every instruction set knows.
template <class V>
HWY_INLINE void store_as_floats(V words, float* out) {
  const Words d;
  const Floats df;
  const hn::Rebind<std::uint16_t, Floats> narrow;
  const Integers di;
  HWY_ALIGN std::uint16_t memory[HWY_MAX_BYTES / sizeof(std::uint16_t)];
  hn::Store(words, d, memory);
  for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(df)) {
    hn::StoreU(hn::ConvertTo(df, hn::PromoteTo(di, hn::LoadU(narrow, memory + i))), df, out + i);
  }
}

void smooth_integer(const SmoothIntegerRow& task) {
  const Words d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const int reach = task.taps.reach;
  const std::uint16_t* pairs = task.taps.pairs;
  const Reads reads = reads_of(task.begin, task.end, reach, lanes);
  for (int x = reads.begin; x < reads.end; x += lanes) {
    auto sum = hn::MulHigh(hn::Set(d, pairs[0]), hn::LoadU(d, task.rows[reach] + x));
    for (int k = 1; k <= reach; ++k) {
      const auto above = hn::LoadU(d, task.rows[reach - k] + x);
      const auto below = hn::LoadU(d, task.rows[reach + k] + x);
      sum = hn::Add(sum, weighted_pair(hn::Set(d, pairs[k]), above, below));
    }
    hn::StoreU(sum, d, task.between + x);
  }
  for (int x = task.begin; x < task.end; x += lanes) {
    const std::uint16_t* centre = task.between + x;
    auto sum = hn::MulHigh(hn::Set(d, pairs[0]), hn::LoadU(d, centre));
    for (int k = 1; k <= reach; ++k) {
      sum = hn::Add(sum,
                    weighted_pair(hn::Set(d, pairs[k]), hn::LoadU(d, centre - k), hn::LoadU(d, centre + k)));
    }
    store_as_floats(sum, task.out + x);
  }
}

// The Hessian at `lanes` pixels from column x on, in units of the 3 x 3 stencil.
template <class V>
struct Hessian {
  V xx;
  V yy;
  V xy4;  // four times lxy
};
HWY_INLINE auto hessian_at(Floats d, const SmoothedRows& rows, int x) {
  const auto twice = hn::Mul(hn::Set(d, 2.0F), hn::LoadU(d, rows.centre + x));
  const auto xx =
      hn::Sub(hn::Add(hn::LoadU(d, rows.centre + x - 1), hn::LoadU(d, rows.centre + x + 1)), twice);
  const auto yy = hn::Sub(hn::Add(hn::LoadU(d, rows.above + x), hn::LoadU(d, rows.below + x)), twice);
  const auto above = hn::Sub(hn::LoadU(d, rows.above + x - 1), hn::LoadU(d, rows.above + x + 1));
  const auto below = hn::Sub(hn::LoadU(d, rows.below + x + 1), hn::LoadU(d, rows.below + x - 1));
  return Hessian<hn::Vec<Floats>>{xx, yy, hn::Add(above, below)};
}

HWY_INLINE hn::Vec<Floats> squared_norm_at(const SmoothedRows& rows, int x) {
  const Floats d;
  const auto h = hessian_at(d, rows, x);
  const auto squares = hn::MulAdd(h.xx, h.xx, hn::Mul(h.yy, h.yy));
  return hn::MulAdd(hn::Mul(h.xy4, hn::Set(d, 0.125F)), h.xy4, squares);
}

float max_norm(const SmoothedRows& rows) {
  const Floats d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  auto greatest = hn::Zero(d);
  for (int x = rows.begin; x < rows.end; x += lanes) {
    greatest = hn::Max(greatest, squared_norm_at(rows, std::min(x, rows.end - lanes)));
  }
  return hn::GetLane(hn::MaxOfLanes(d, greatest));
}

void keep_max_norms(const SmoothedRows& rows, float* greatest) {
  const Floats d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  for (int begin = rows.begin; begin < rows.end; begin += lanes) {
    const int x = std::min(begin, rows.end - lanes);
    hn::StoreU(hn::Max(hn::LoadU(d, greatest + x), squared_norm_at(rows, x)), d, greatest + x);
  }
}

// For dark ridges the eigenvalue of greater magnitude is positive: it is mean + spread, and mean > 0.
template <bool kWithDirection>
HWY_INLINE void respond_at(const SmoothedRows& rows, const ResponseScale& scale, const RidgeRow& maps,
                           int x) {
  const Floats d;
  const auto h = hessian_at(d, rows, x);
  const auto half_variance = hn::Set(d, 0.5F * scale.variance);
  const auto mean = hn::Mul(hn::Add(h.xx, h.yy), half_variance);
  const auto difference = hn::Mul(hn::Sub(h.xx, h.yy), half_variance);
  const auto xy = hn::Mul(h.xy4, hn::Set(d, 0.25F * scale.variance));
  const auto spread_squared = hn::MulAdd(difference, difference, hn::Mul(xy, xy));
  const auto spread = hn::Sqrt(spread_squared);
  const auto large = hn::Max(hn::Add(mean, spread), hn::Set(d, 1e-12F));
  const auto ratio = hn::Div(hn::Sub(mean, spread), large);
  const auto blob = hn::Mul(hn::Mul(ratio, ratio), hn::Set(d, scale.per_blob));
  const auto norm = hn::MulAdd(mean, mean, spread_squared);
  const auto both = hn::MulAdd(norm, hn::Set(d, scale.per_norm), blob);
  const auto difference_of_powers = hn::Sub(exp2_nonpositive(d, blob), exp2_nonpositive(d, both));
  const auto zero = hn::Zero(d);
  const auto response = hn::IfThenElseZero(hn::Gt(mean, zero), hn::Max(difference_of_powers, zero));
  const auto before = scale.first ? zero : hn::LoadU(d, maps.vesselness + x);
  hn::StoreU(hn::Max(response, before), d, maps.vesselness + x);
  if constexpr (kWithDirection) {
    const auto better = hn::Gt(response, before);
    const auto keep = [&](auto value, float* map) HWY_ATTR {
      const auto old = scale.first ? zero : hn::LoadU(d, map + x);
      hn::StoreU(hn::IfThenElse(better, value, old), d, map + x);
    };
    // Across the ridge the doubled angle points along {difference, xy}; along it, the other way.
    const auto per_spread = hn::Div(hn::Set(d, -1.0F), hn::Max(spread, hn::Set(d, 1e-20F)));
    keep(hn::Set(d, scale.sigma_px), maps.scale_px);
    keep(hn::Mul(difference, per_spread), maps.double_angle_cos);
    keep(hn::Mul(xy, per_spread), maps.double_angle_sin);
  }
}

template <bool kWithDirection>
HWY_INLINE void respond_along(const SmoothedRows& rows, const ResponseScale& scale, const RidgeRow& maps) {
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  int x = rows.begin;
  for (; x + lanes <= rows.end; x += lanes) {
    respond_at<kWithDirection>(rows, scale, maps, x);
  }
  if (x < rows.end) {
    // Some pixels a second time: they come out the same.
    respond_at<kWithDirection>(rows, scale, maps, rows.end - lanes);
  }
}

void respond_row(const SmoothedRows& rows, const ResponseScale& scale, const RidgeRow& maps) {
  if (maps.scale_px != nullptr) {
    respond_along<true>(rows, scale, maps);
  } else {
    respond_along<false>(rows, scale, maps);
  }
}

// Plain loops: the compiler makes registers of them for this instruction set.
template <typename From>
HWY_INLINE void to_floats(const From* HWY_RESTRICT from, int count, float* HWY_RESTRICT to) {
  for (int i = 0; i < count; ++i) {
    to[i] = static_cast<float>(from[i]);
  }
}
template <typename From>
HWY_INLINE void to_words(const From* HWY_RESTRICT from, int count, int shift,
                         std::uint16_t* HWY_RESTRICT to) {
  for (int i = 0; i < count; ++i) {
    to[i] = static_cast<std::uint16_t>(static_cast<unsigned>(from[i]) << shift);
  }
}
void bytes_to_floats(const std::uint8_t* from, int count, float* to) { to_floats(from, count, to); }
void words_to_floats(const std::uint16_t* from, int count, float* to) { to_floats(from, count, to); }
void bytes_to_words(const std::uint8_t* from, int count, int shift, std::uint16_t* to) {
  to_words(from, count, shift, to);
}
void words_to_words(const std::uint16_t* from, int count, int shift, std::uint16_t* to) {
  to_words(from, count, shift, to);
}
void floats_to_words(const float* HWY_RESTRICT from, int count, int shift, std::uint16_t* HWY_RESTRICT to) {
  for (int i = 0; i < count; ++i) {
    to[i] = static_cast<std::uint16_t>(static_cast<int>(from[i]) << shift);
  }
}

std::int64_t instruction_set() { return HWY_TARGET; }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace tubed
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tubed {

namespace {
HWY_EXPORT(smooth_float);
HWY_EXPORT(smooth_integer);
HWY_EXPORT(max_norm);
HWY_EXPORT(keep_max_norms);
HWY_EXPORT(respond_row);
HWY_EXPORT(bytes_to_floats);
HWY_EXPORT(words_to_floats);
HWY_EXPORT(bytes_to_words);
HWY_EXPORT(words_to_words);
HWY_EXPORT(floats_to_words);
HWY_EXPORT(instruction_set);
}  // namespace

void smooth_row(const SmoothFloatRow& task) { HWY_DYNAMIC_DISPATCH(smooth_float)(task); }
void smooth_row(const SmoothIntegerRow& task) { HWY_DYNAMIC_DISPATCH(smooth_integer)(task); }
float max_squared_norm(const SmoothedRows& rows) { return HWY_DYNAMIC_DISPATCH(max_norm)(rows); }
void keep_max_squared_norms(const SmoothedRows& rows, float* greatest) {
  HWY_DYNAMIC_DISPATCH(keep_max_norms)(rows, greatest);
}
void respond(const SmoothedRows& rows, const ResponseScale& scale, const RidgeRow& maps) {
  HWY_DYNAMIC_DISPATCH(respond_row)(rows, scale, maps);
}
void convert_row(const std::uint8_t* from, int count, float* to) {
  HWY_DYNAMIC_DISPATCH(bytes_to_floats)(from, count, to);
}
void convert_row(const std::uint16_t* from, int count, float* to) {
  HWY_DYNAMIC_DISPATCH(words_to_floats)(from, count, to);
}
void convert_row(const float* from, int count, float* to) { std::copy(from, from + count, to); }
void convert_row(const std::uint8_t* from, int count, int shift, std::uint16_t* to) {
  HWY_DYNAMIC_DISPATCH(bytes_to_words)(from, count, shift, to);
}
void convert_row(const std::uint16_t* from, int count, int shift, std::uint16_t* to) {
  HWY_DYNAMIC_DISPATCH(words_to_words)(from, count, shift, to);
}
void convert_row(const float* from, int count, int shift, std::uint16_t* to) {
  HWY_DYNAMIC_DISPATCH(floats_to_words)(from, count, shift, to);
}
const char* frangi_instruction_set() { return hwy::TargetName(HWY_DYNAMIC_DISPATCH(instruction_set)()); }

}  // namespace tubed
#endif
