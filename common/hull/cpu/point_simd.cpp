#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/cpu/point_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "common/hull/cpu/point_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

// Bound of rounding from a point to its pixel, here and in in_hull() together: fewer than 30
// roundings of half an epsilon each.
constexpr double kRoundings = 32 * std::numeric_limits<double>::epsilon();

// One coordinate of a pixel, and a bound of its difference from the one that in_hull() computes.
struct Position {
  V px, error_px;
};
HWY_INLINE Position position(V x, V per_z, V rounding_m, double focal_px, double principal_px) {
  const D d;
  const V slope = hn::Mul(x, per_z),
          px = hn::Add(hn::Mul(hn::Set(d, focal_px), slope), hn::Set(d, principal_px));
  const V moved = hn::Mul(hn::Mul(hn::Set(d, focal_px), hn::Add(hn::Set(d, 1.0), hn::Abs(slope))),
                          hn::Mul(rounding_m, per_z));
  const V rounded = hn::Mul(
      hn::Set(d, kRoundings),
      hn::Add(hn::Abs(px), hn::Set(d, principal_px < 0 ? 1 - principal_px : 1 + principal_px)));
  return {px, hn::Add(hn::Add(moved, moved), rounded)};
}

void contains(std::span<const PointSimdCamera> cameras, const double* xyz, std::size_t count,
              InHull* verdicts) {
  const D d;
  const hn::Rebind<std::int32_t, D> di;
  const std::size_t lanes = hn::Lanes(d);
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  for (std::size_t first = 0; first + lanes <= count; first += lanes) {
    V x, y, z;
    hn::LoadInterleaved3(d, xyz + 3 * first, x, y, z);
    const V size_m = hn::Add(hn::Abs(x), hn::Add(hn::Abs(y), hn::Abs(z)));
    auto in = hn::Eq(zero, zero), uncertain = hn::Lt(zero, zero);
    for (const PointSimdCamera& c : cameras) {
      const auto row = [&](int i) {
        const double* m = c.camera_from_world + 4 * i;
        return hn::Add(hn::Add(hn::Mul(hn::Set(d, m[0]), x), hn::Mul(hn::Set(d, m[1]), y)),
                       hn::Add(hn::Mul(hn::Set(d, m[2]), z), hn::Set(d, m[3])));
      };
      const V zc = row(2), rounding_m = hn::Mul(hn::Set(d, kRoundings),
                                                hn::Add(size_m, hn::Set(d, c.translation_m)));
      const auto in_front = hn::Gt(zc, hn::Add(rounding_m, rounding_m)),
                 behind = hn::Lt(zc, hn::Neg(rounding_m));
      const V per_z = hn::Div(one, zc);
      const Position u = position(row(0), per_z, rounding_m, c.fx_px, c.cx_px),
                     v = position(row(1), per_z, rounding_m, c.fy_px, c.cy_px);
      const auto beyond = [&](const Position& p, double low, double high) {
        return hn::Or(hn::Lt(hn::Add(p.px, p.error_px), hn::Set(d, low)),
                      hn::Gt(hn::Sub(p.px, p.error_px), hn::Set(d, high)));
      };
      const auto out = hn::Or(behind, hn::And(in_front, hn::Or(beyond(u, c.u0_px, c.u1_px),
                                                               beyond(v, c.v0_px, c.v1_px))));
      in = hn::AndNot(out, in);
      if (hn::AllFalse(d, in)) break;
      const V whole_u = hn::Floor(u.px), whole_v = hn::Floor(v.px);
      const auto sure = [&](const Position& p, V whole) {
        const V from = hn::Sub(p.px, whole);
        return hn::And(hn::Gt(from, p.error_px), hn::Lt(hn::Add(from, p.error_px), one));
      };
      const auto certain = hn::And(in_front, hn::And(sure(u, whole_u), sure(v, whole_v)));
      uncertain = hn::Or(uncertain, hn::AndNot(certain, in));
      in = hn::And(in, certain);
      // Points that are certainly in the bounds have a stored extent; the others read the first
      // byte.
      const V at =
          hn::Add(hn::Mul(hn::Sub(whole_v, hn::Set(d, c.stored_v0_px)), hn::Set(d, c.stride)),
                  hn::Sub(whole_u, hn::Set(d, c.stored_u0_px)));
      alignas(64) std::int32_t offsets[8];
      hn::Store(hn::DemoteTo(di, hn::IfThenElseZero(in, at)), di, offsets);
      alignas(64) double extents[8];
      for (std::size_t i = 0; i < lanes; ++i) extents[i] = c.extents[offsets[i]];
      in = hn::And(in, hn::Lt(hn::Load(d, extents), zero));
      if (hn::AllFalse(d, in)) break;
    }
    alignas(64) double result[8];
    hn::Store(hn::IfThenElse(uncertain, hn::Set(d, 2.0), hn::IfThenElseZero(in, one)), d, result);
    for (std::size_t i = 0; i < lanes; ++i) verdicts[first + i] = InHull(int(result[i]));
  }
  for (std::size_t i = count - count % lanes; i < count; ++i) verdicts[i] = InHull::uncertain;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::hull {
namespace {
HWY_EXPORT(contains);
}  // namespace

std::vector<PointSimdCamera> point_simd_cameras(const CpuHull& hull) {
  std::vector<PointSimdCamera> cameras;
  for (const CpuHull::MapCamera& c : hull.cameras()) {
    const geometry::Pinhole& k = c.camera.pinhole;
    const PixelRect& b = c.skip_map.bounds();
    const PixelRect& stored = c.skip_map.stored();
    PointSimdCamera lane{{},
                         k.fx_px,
                         k.fy_px,
                         k.cx_px + 0.5,
                         k.cy_px + 0.5,
                         double(b.u0_px),
                         double(b.u1_px),
                         double(b.v0_px),
                         double(b.v1_px),
                         c.camera.camera_from_world.translation().cwiseAbs().sum(),
                         c.skip_map.bytes(Quadrant::right_down),
                         double(stored.u0_px),
                         double(stored.v0_px),
                         double(c.skip_map.stride())};
    for (int i = 0; i < 12; ++i)
      lane.camera_from_world[i] = c.camera.camera_from_world.matrix()(i / 4, i % 4);
    cameras.push_back(lane);
  }
  return cameras;
}

void contains_simd(std::span<const PointSimdCamera> cameras,
                   std::span<const Eigen::Vector3d> p_world_m, InHull* verdicts) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  if (!p_world_m.empty())
    HWY_DYNAMIC_DISPATCH(contains)(cameras, p_world_m.data()->data(), p_world_m.size(), verdicts);
}

}  // namespace fivepipe::hull
#endif
