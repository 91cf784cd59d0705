#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/silhouette/hull_distance_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "common/hull/silhouette/hull_distance_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Returns the distances at positions (u, v) of the region, linear between the pixels' centres.
// Lanes that are not `in` read the first pixels.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V distance_at(D d, const BorderDistance::Region& region, V u, V v, hn::Mask<D> in) {
  const V column = hn::Floor(u), row = hn::Floor(v), fu = hn::Sub(u, column), fv = hn::Sub(v, row),
          one = hn::Set(d, 1.0);
  const V pixel = hn::Add(hn::Mul(row, hn::Set(d, double(region.width_px))), column);
  alignas(64) std::int32_t pixels[8];
  hn::Store(hn::DemoteTo(hn::Rebind<std::int32_t, D>(), hn::IfThenElseZero(in, pixel)),
            hn::Rebind<std::int32_t, D>(), pixels);
  alignas(64) double corners[4][8];
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    const float* const first = region.distance_px + pixels[i];
    corners[0][i] = double(first[0]), corners[1][i] = double(first[1]);
    corners[2][i] = double(first[region.width_px]);
    corners[3][i] = double(first[region.width_px + 1]);
  }
  const auto mixed = [&](const double* a, const double* b) {
    return hn::Add(hn::Mul(hn::Sub(one, fu), hn::Load(d, a)), hn::Mul(fu, hn::Load(d, b)));
  };
  return hn::Add(hn::Mul(hn::Sub(one, fv), mixed(corners[0], corners[1])),
                 hn::Mul(fv, mixed(corners[2], corners[3])));
}

template <class D>
HWY_INLINE void borders_of_lanes(D d, std::span<const DistanceSimdCamera> cameras, int min_seen,
                                 const double* xyz, double reach_m, LimitingBorder* borders) {
  using V = hn::Vec<D>;
  V x, y, z;
  hn::LoadInterleaved3(d, xyz, x, y, z);
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  auto in = hn::Eq(zero, zero);
  V min_m = hn::Set(d, std::numeric_limits<double>::infinity()), px_of_min = zero,
    camera = hn::Set(d, -1.0), seen = zero;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const DistanceSimdCamera& c = cameras[i];
    const auto row = [&](int r) {
      const double* m = c.pixel_from_world + 4 * r;
      return hn::Add(hn::Add(hn::Mul(hn::Set(d, m[0]), x), hn::Mul(hn::Set(d, m[1]), y)),
                     hn::Add(hn::Mul(hn::Set(d, m[2]), z), hn::Set(d, m[3])));
    };
    const V depth_m = row(2), per_depth = hn::Div(one, depth_m);
    const V u_px = hn::Mul(row(0), per_depth), v_px = hn::Mul(row(1), per_depth),
            u = hn::Sub(u_px, hn::Set(d, double(c.distance.u0_px))),
            v = hn::Sub(v_px, hn::Set(d, double(c.distance.v0_px)));
    const auto is_in_front = hn::Gt(depth_m, zero);
    // A camera that does not limit the hull at a point leaves its lane as it is.
    auto limits = hn::Eq(zero, zero);
    if (min_seen > 0) {
      const V edge = hn::Set(d, -0.5);
      limits = hn::And(
          is_in_front,
          hn::And(hn::And(hn::Ge(u_px, edge), hn::Lt(u_px, hn::Set(d, c.image_width_px - 0.5))),
                  hn::And(hn::Ge(v_px, edge), hn::Lt(v_px, hn::Set(d, c.image_height_px - 0.5)))));
      seen = hn::Add(seen, hn::IfThenElseZero(limits, one));
      if (hn::AllFalse(d, hn::And(in, limits))) continue;
    }
    const auto is_in_region =
        hn::And(hn::And(hn::Ge(u, zero), hn::Lt(u, hn::Set(d, c.distance.width_px - 1.0))),
                hn::And(hn::Ge(v, zero), hn::Lt(v, hn::Set(d, c.distance.height_px - 1.0))));
    const auto can_hold = hn::And(is_in_front, is_in_region);
    in = hn::And(in, hn::Or(can_hold, hn::Not(limits)));
    const auto is_read = hn::And(in, can_hold);
    if (hn::AllFalse(d, in)) break;
    if (hn::AllFalse(d, is_read)) continue;
    const V distance_px = distance_at(d, c.distance, u, v, is_read);
    const V distance_m = hn::Mul(hn::Mul(distance_px, depth_m), hn::Set(d, c.per_focal_px));
    const auto is_near = hn::And(hn::Ge(distance_m, hn::Set(d, -reach_m)),
                                 hn::Ge(distance_px, hn::Set(d, -double(kMaxOutside_px))));
    in = hn::And(in, hn::Or(is_near, hn::Not(limits)));
    if (hn::AllFalse(d, in)) break;
    const auto is_min = hn::And(limits, hn::Lt(distance_m, min_m));
    min_m = hn::IfThenElse(is_min, distance_m, min_m);
    px_of_min = hn::IfThenElse(is_min, distance_px, px_of_min);
    camera = hn::IfThenElse(is_min, hn::Set(d, double(i)), camera);
  }
  if (min_seen > 0) in = hn::And(in, hn::Ge(seen, hn::Set(d, double(min_seen))));
  alignas(64) double cameras_of[8], distances_px[8];
  hn::Store(hn::IfThenElse(in, camera, hn::Set(d, -1.0)), d, cameras_of);
  hn::Store(px_of_min, d, distances_px);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i)
    borders[i] = {std::int32_t(cameras_of[i]), distances_px[i]};
}

void borders(std::span<const DistanceSimdCamera> cameras, int min_seen, const double* xyz,
             std::size_t count, double reach_m, LimitingBorder* result) {
  const hn::CappedTag<double, 8> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    borders_of_lanes(d, cameras, min_seen, xyz + 3 * i, reach_m, result + i);
  for (; i < count; ++i)
    borders_of_lanes(hn::CappedTag<double, 1>(), cameras, min_seen, xyz + 3 * i, reach_m,
                     result + i);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::hull {
namespace {
HWY_EXPORT(borders);
}  // namespace

void limiting_borders(std::span<const DistanceSimdCamera> cameras, int min_seen,
                      std::span<const Eigen::Vector3d> p_world_m, double reach_m,
                      LimitingBorder* result) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  if (!p_world_m.empty()) HWY_DYNAMIC_DISPATCH(borders)
  (cameras, min_seen, p_world_m.data()->data(), p_world_m.size(), reach_m, result);
}

}  // namespace fivepipe::hull
#endif
