#include "daemon/estimator/algebra/line_kernels.hpp"

// This file is compiled once for each instruction set: Highway includes it again for every one.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "daemon/estimator/algebra/line_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tubed {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, kLineLanes>;

// As Camera::project(), with the line's normal in front of the Jacobian from the beginning: two numbers are
// carried instead of six.
void project_lines_of(const LineCamera& camera, const LineRows& rows, const LineResults& results) {
  const Doubles d;
  const auto set = [d](double value) HWY_ATTR { return hn::Set(d, value); };
  const auto& T = camera.T_camera_world;
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  const auto one = set(1);
  for (std::size_t i = 0; i < rows.count; i += hn::Lanes(d)) {
    const auto px = hn::LoadU(d, rows.x_world_mm + i);
    const auto py = hn::LoadU(d, rows.y_world_mm + i);
    const auto pz = hn::LoadU(d, rows.z_world_mm + i);
    const auto row = [&](std::size_t r) HWY_ATTR {
      const auto sum = hn::MulAdd(set(T[4 * r + 2]), pz, set(T[4 * r + 3]));
      return hn::MulAdd(set(T[4 * r]), px, hn::MulAdd(set(T[4 * r + 1]), py, sum));
    };
    const auto depth = row(2);
    const auto in_front = hn::Gt(depth, hn::Zero(d));
    const auto per_depth = hn::Div(one, hn::IfThenElse(in_front, depth, one));
    const auto x = hn::Mul(row(0), per_depth);
    const auto y = hn::Mul(row(1), per_depth);
    // Brown's distortion (OpenCV's order k1, k2, p1, p2, k3): xd = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x
    // y + p2 (r^2 + 2 x^2).
    const auto r2 = hn::MulAdd(x, x, hn::Mul(y, y));
    const auto radial = hn::MulAdd(r2, hn::MulAdd(r2, hn::MulAdd(r2, set(k3), set(k2)), set(k1)), one);
    const auto slope = hn::MulAdd(r2, hn::MulAdd(r2, set(3 * k3), set(2 * k2)), set(k1));
    const auto twice_slope = hn::Add(slope, slope);
    const auto xy = hn::Mul(x, y);
    const auto xd = hn::MulAdd(
        x, radial, hn::MulAdd(set(2 * p1), xy, hn::Mul(set(p2), hn::MulAdd(set(2), hn::Mul(x, x), r2))));
    const auto yd = hn::MulAdd(
        y, radial, hn::MulAdd(set(2 * p2), xy, hn::Mul(set(p1), hn::MulAdd(set(2), hn::Mul(y, y), r2))));
    // d(xd, yd) / d(x, y): dxx = radial + 2 x^2 d radial / d r^2 + 2 p1 y + 6 p2 x; mixed = dxd/dy = dyd/dx.
    const auto mixed = hn::MulAdd(xy, twice_slope, hn::MulAdd(set(2 * p1), x, hn::Mul(set(2 * p2), y)));
    const auto dxx = hn::Add(hn::MulAdd(hn::Mul(x, x), twice_slope, radial),
                             hn::MulAdd(set(2 * p1), y, hn::Mul(set(6 * p2), x)));
    const auto dyy = hn::Add(hn::MulAdd(hn::Mul(y, y), twice_slope, radial),
                             hn::MulAdd(set(6 * p1), y, hn::Mul(set(2 * p2), x)));
    const auto nx = hn::LoadU(d, rows.normal_x + i);
    const auto ny = hn::LoadU(d, rows.normal_y + i);
    const auto u = hn::MulAdd(set(camera.fx), xd, set(camera.cx));
    const auto v = hn::MulAdd(set(camera.fy), yd, set(camera.cy));
    const auto residual = hn::MulAdd(nx, u, hn::MulSub(ny, v, hn::LoadU(d, rows.target + i)));
    const auto nfx = hn::Mul(nx, set(camera.fx));
    const auto nfy = hn::Mul(ny, set(camera.fy));
    const auto a = hn::Mul(hn::MulAdd(nfx, dxx, hn::Mul(nfy, mixed)), per_depth);
    const auto b = hn::Mul(hn::MulAdd(nfx, mixed, hn::Mul(nfy, dyy)), per_depth);
    // Chain rule through x = X / Z, y = Y / Z: (a, b, c) is the gradient in the camera's frame; its product
    // with the rotation is the one in the world's.
    const auto c = hn::Neg(hn::MulAdd(a, x, hn::Mul(b, y)));
    const auto column = [&](std::size_t k) HWY_ATTR {
      const auto sum = hn::MulAdd(c, set(T[8 + k]), hn::Mul(b, set(T[4 + k])));
      return hn::IfThenElseZero(in_front, hn::MulAdd(a, set(T[k]), sum));
    };
    hn::StoreU(hn::IfThenElseZero(in_front, residual), d, results.residual + i);
    hn::StoreU(column(0), d, results.gradient_x + i);
    hn::StoreU(column(1), d, results.gradient_y + i);
    hn::StoreU(column(2), d, results.gradient_z + i);
  }
}

void add_products(const double* HWY_RESTRICT outer, const double* HWY_RESTRICT products, std::size_t count,
                  double* HWY_RESTRICT sums) {
  const Doubles d;
  const std::size_t n = hn::Lanes(d);
  for (std::size_t part = 0; part < 8; part += n) {
    for (std::size_t half = 0; half < 10; half += 5) {  // as many sums as registers hold
      double* const to = sums + part + 8 * half;
      auto s0 = hn::LoadU(d, to);
      auto s1 = hn::LoadU(d, to + 8);
      auto s2 = hn::LoadU(d, to + 16);
      auto s3 = hn::LoadU(d, to + 24);
      auto s4 = hn::LoadU(d, to + 32);
      for (std::size_t i = 0; i < count; ++i) {
        const auto g = hn::LoadU(d, outer + 8 * i + part);
        const double* const w = products + 12 * i + half;
        s0 = hn::MulAdd(g, hn::Set(d, w[0]), s0);
        s1 = hn::MulAdd(g, hn::Set(d, w[1]), s1);
        s2 = hn::MulAdd(g, hn::Set(d, w[2]), s2);
        s3 = hn::MulAdd(g, hn::Set(d, w[3]), s3);
        s4 = hn::MulAdd(g, hn::Set(d, w[4]), s4);
      }
      hn::StoreU(s0, d, to);
      hn::StoreU(s1, d, to + 8);
      hn::StoreU(s2, d, to + 16);
      hn::StoreU(s3, d, to + 24);
      hn::StoreU(s4, d, to + 32);
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace tubed
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tubed {

namespace {
HWY_EXPORT(project_lines_of);
HWY_EXPORT(add_products);
}  // namespace

LineCamera::LineCamera(const CameraCalibration& calibration)
    : fx(calibration.fx),
      fy(calibration.fy),
      cx(calibration.cx),
      cy(calibration.cy),
      distortion(calibration.distortion) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) {
      T_camera_world[static_cast<std::size_t>(4 * r + c)] =
          c < 3 ? calibration.T_camera_world.linear()(r, c) : calibration.T_camera_world.translation()(r);
    }
  }
}

void project_to_lines(const LineCamera& camera, const LineRows& rows, const LineResults& results) {
  HWY_DYNAMIC_DISPATCH(project_lines_of)(camera, rows, results);
}
void add_outer_products(const double* outer, const double* products, std::size_t count, double* sums) {
  HWY_DYNAMIC_DISPATCH(add_products)(outer, products, count, sums);
}

}  // namespace tubed
#endif
