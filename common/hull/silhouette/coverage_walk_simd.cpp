#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/silhouette/coverage_walk_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>

#include "common/hull/map_from_view.h"
#include "common/hull/silhouette/coverage_walk.h"
#include "common/hull/silhouette/coverage_walk_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// 29 of 30 rays enter a silhouette within these cells, and the hull within these rounds.
constexpr int kMaxCells = 8;
constexpr std::size_t kMaxRounds = 4;
constexpr std::size_t kMaxLanes = 8;

// ImageLine of each lane's ray, and its point at t.
template <class D, class V = hn::Vec<D>>
struct Lines {
  V u_offset, u_slope, v_offset, v_slope, w_offset, w_slope;

  HWY_INLINE Lines(D d, const CoverageSimdCamera& c, V u_px, double v_px) {
    const auto slope = [&](int row) {
      const double* m = c.at_infinity + 3 * row;
      return hn::Add(hn::Mul(hn::Set(d, m[0]), u_px), hn::Set(d, m[1] * v_px + m[2]));
    };
    u_offset = hn::Set(d, c.at_eye[0]), u_slope = slope(0);
    v_offset = hn::Set(d, c.at_eye[1]), v_slope = slope(1);
    w_offset = hn::Set(d, c.at_eye[2]), w_slope = slope(2);
  }
  HWY_INLINE V w_at(V t) const { return hn::Add(w_offset, hn::Mul(t, w_slope)); }
};

template <class D, class V = hn::Vec<D>>
struct Image {
  V u, v, w;
  hn::Mask<D> is_seen;

  HWY_INLINE Image(D d, const CoverageSimdCamera& c, const Lines<D>& line, V t) : w(line.w_at(t)) {
    const V per_w = hn::Div(hn::Set(d, 1.0), w), half = hn::Set(d, 0.5);
    u = hn::Mul(hn::Add(line.u_offset, hn::Mul(t, line.u_slope)), per_w);
    v = hn::Mul(hn::Add(line.v_offset, hn::Mul(t, line.v_slope)), per_w);
    is_seen = hn::And(hn::Gt(w, hn::Set(d, kNearestToCamera_m)),
                      hn::And(hn::And(hn::Ge(u, half), hn::Ge(v, half)),
                              hn::And(hn::Lt(u, hn::Set(d, c.width_cells - 0.5)),
                                      hn::Lt(v, hn::Set(d, c.height_cells - 0.5)))));
  }
};

template <class D>
HWY_INLINE void store_integers(D, hn::Vec<D> value, std::int32_t* integers) {
  const hn::Rebind<std::int32_t, D> di;
  hn::StoreU(hn::DemoteTo(di, value), di, integers);
}

template <class D>
HWY_INLINE hn::Mask<D> in_whole_cell(D d, const CoverageSimdCamera& c, const Image<D>& p) {
  if (hn::AllFalse(d, p.is_seen)) return p.is_seen;
  std::int32_t columns[kMaxLanes], rows[kMaxLanes];
  store_integers(d, hn::IfThenElseZero(p.is_seen, p.u), columns);
  store_integers(d, hn::IfThenElseZero(p.is_seen, p.v), rows);
  static_assert(kMaxLanes <= 8, "one bit per lane");
  std::uint8_t whole[8] = {};
  for (std::size_t i = 0; i < hn::Lanes(d); ++i)
    whole[0] |= (c.whole_cells[std::ptrdiff_t(rows[i]) * c.words_per_row + (columns[i] >> 6)] >>
                     (columns[i] & 63) &
                 1)
                << i;
  return hn::And(p.is_seen, hn::LoadMaskBits(d, whole));
}

// Sides (side_of_border()) of the corners of each lane's cell.
template <class D, class V = hn::Vec<D>>
struct Corners {
  V s00, s10, s01, s11;

  HWY_INLINE Corners(D d, const CoverageSimdCamera& c, V u_cell, V v_cell, hn::Mask<D> valid) {
    const hn::Rebind<std::int32_t, D> di;
    // Column and row in the window of the corner with the smallest indices.
    const V column = hn::Sub(u_cell, hn::Set(d, c.u0_px + 1.0)),
            row = hn::Sub(v_cell, hn::Set(d, c.v0_px + 1.0)), zero = hn::Zero(d);
    valid = hn::And(valid, hn::And(hn::Ge(column, zero), hn::Ge(row, zero)));
    valid = hn::And(valid, hn::And(hn::Lt(column, hn::Set(d, c.width_px - 1.0)),
                                   hn::Lt(row, hn::Set(d, c.height_px - 1.0))));
    const V pixel = hn::Add(hn::Mul(row, hn::Set(d, double(c.width_px))), column);
    std::int32_t pixels[kMaxLanes], above[kMaxLanes] = {}, below[kMaxLanes] = {};
    store_integers(d, hn::IfThenElse(valid, pixel, hn::Set(d, -1.0)), pixels);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      if (pixels[i] < 0) continue;
      const std::uint8_t* const first = c.coverage + pixels[i];
      above[i] = first[0] | first[1] << 8;
      below[i] = first[c.width_px] | first[c.width_px + 1] << 8;
    }
    const auto side = [&](auto bytes) {
      return hn::Sub(hn::PromoteTo(d, hn::Add(bytes, bytes)), hn::Set(d, double(kFullCoverage)));
    };
    const auto low = hn::Set(di, 0xff);
    const auto top = hn::LoadU(di, above), bottom = hn::LoadU(di, below);
    s00 = side(hn::And(top, low)), s10 = side(hn::ShiftRight<8>(top));
    s01 = side(hn::And(bottom, low)), s11 = side(hn::ShiftRight<8>(bottom));
  }
};

// Where the lanes' rays are.
template <class D, class V = hn::Vec<D>>
struct Progress {
  V t;
  hn::Mask<D> never;       // outside of a silhouette up to the end
  hn::Mask<D> unresolved;  // left to CoverageWalk
};

// CoverageWalk::walk() for the lanes of `walking`, whose image is p. In all others, and in lanes
// that become unresolved, t stays.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void walk_cells(D d, const CoverageSimdCamera& c, const Lines<D>& line,
                           const Image<D>& p, V end, hn::Mask<D> walking, Progress<D>& progress) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0), half = hn::Set(d, 0.5);
  const V never = hn::Set(d, kNever), uncertain = hn::Set(d, kUncertainSide);
  progress.unresolved = hn::Or(progress.unresolved, hn::AndNot(p.is_seen, walking));
  walking = hn::And(walking, p.is_seen);

  const auto right =
      hn::Gt(hn::Mul(line.u_slope, line.w_offset), hn::Mul(line.u_offset, line.w_slope));
  const auto down =
      hn::Gt(hn::Mul(line.v_slope, line.w_offset), hn::Mul(line.v_offset, line.w_slope));
  const V du = hn::Mul(p.w, hn::Sub(line.u_slope, hn::Mul(p.u, line.w_slope))),
          dv = hn::Mul(p.w, hn::Sub(line.v_slope, hn::Mul(p.v, line.w_slope)));
  const V per_du = hn::Div(one, du), per_dv = hn::Div(one, dv);
  const V end_w = line.w_at(end);
  V s_end = hn::IfThenElse(hn::Gt(end_w, hn::Set(d, kNearestToCamera_m)),
                           hn::Div(hn::Sub(end, progress.t), hn::Mul(p.w, end_w)), never);
  // Only rounding decides whether the image moves, or it does not.
  const auto stays = hn::Or(hn::Xor(right, hn::Gt(du, zero)), hn::Xor(down, hn::Gt(dv, zero)));
  const auto clear = hn::AndNot(hn::Or(stays, hn::Or(hn::Eq(du, zero), hn::Eq(dv, zero))), walking);
  progress.unresolved = hn::Or(progress.unresolved, hn::AndNot(clear, walking));
  walking = clear;
  const V image_u = hn::IfThenElse(right, hn::Set(d, c.width_cells - 0.5), half),
          image_v = hn::IfThenElse(down, hn::Set(d, c.height_cells - 0.5), half);
  s_end = hn::Min(s_end, hn::Min(hn::Mul(hn::Sub(image_u, p.u), per_du),
                                 hn::Mul(hn::Sub(image_v, p.v), per_dv)));

  const V past_u = hn::IfThenElse(right, one, zero), past_v = hn::IfThenElse(down, one, zero);
  const V step_u = hn::IfThenElse(right, one, hn::Neg(one)),
          step_v = hn::IfThenElse(down, one, hn::Neg(one));
  V s = zero, u = hn::Floor(p.u), v = hn::Floor(p.v);
  auto found = hn::AndNot(walking, walking);
  auto passed = hn::AndNot(hn::Lt(s, s_end), walking);
  progress.never = hn::Or(progress.never, passed);
  walking = hn::AndNot(passed, walking);
  for (int cell = 0; cell < kMaxCells && !hn::AllFalse(d, walking); ++cell) {
    const V at_u = hn::Mul(hn::Sub(hn::Add(u, past_u), p.u), per_du),
            at_v = hn::Mul(hn::Sub(hn::Add(v, past_v), p.v), per_dv);
    const auto leaves_by_u = hn::Le(at_u, at_v);
    const V leaves = hn::Max(s, hn::IfThenElse(leaves_by_u, at_u, at_v));
    const V length = hn::Sub(hn::Min(leaves, s_end), s);

    const Corners<D> corners(d, c, u, v, walking);
    const V by_1 = corners.s00, by_u = hn::Sub(corners.s10, by_1),
            by_v = hn::Sub(corners.s01, by_1),
            by_uv = hn::Add(hn::Sub(hn::Sub(by_1, corners.s10), corners.s01), corners.s11);
    const V x = hn::Sub(hn::Add(p.u, hn::Mul(s, du)), u),
            y = hn::Sub(hn::Add(p.v, hn::Mul(s, dv)), v);
    const V constant =
        hn::Add(hn::Add(by_1, hn::Mul(by_u, x)), hn::Mul(hn::Add(by_v, hn::Mul(by_uv, x)), y));
    const V linear = hn::Add(hn::Add(hn::Mul(by_u, du), hn::Mul(by_v, dv)),
                             hn::Mul(by_uv, hn::Add(hn::Mul(x, dv), hn::Mul(y, du))));
    const V square = hn::Mul(hn::Mul(by_uv, du), dv);

    const auto inside = hn::And(walking, hn::Gt(constant, uncertain));
    const auto unclear = hn::And(walking, hn::Le(hn::Abs(constant), uncertain));
    progress.unresolved = hn::Or(progress.unresolved, unclear);
    found = hn::Or(found, inside);
    walking = hn::AndNot(hn::Or(inside, unclear), walking);
    // first_rise()
    const V twice_square = hn::Add(square, square);
    const V at_end = hn::Add(constant, hn::Mul(length, hn::Add(linear, hn::Mul(length, square))));
    const auto has_maximum =
        hn::And(hn::Gt(linear, zero), hn::Lt(hn::Add(linear, hn::Mul(twice_square, length)), zero));
    auto rises = hn::And(walking, hn::Or(hn::Gt(at_end, zero), has_maximum));
    if (!hn::AllFalse(d, rises)) {
      const V discriminant =
          hn::Sub(hn::Mul(linear, linear), hn::Mul(hn::Add(twice_square, twice_square), constant));
      rises = hn::And(rises, hn::Gt(discriminant, zero));
      const V root = hn::Sqrt(hn::IfThenElseZero(rises, discriminant));
      const auto is_positive = hn::Gt(linear, zero);
      const V rise = hn::Div(
          hn::IfThenElse(is_positive, hn::Neg(hn::Add(constant, constant)), hn::Sub(root, linear)),
          hn::IfThenElse(is_positive, hn::Add(linear, root), twice_square));
      s = hn::IfThenElse(rises, hn::Add(s, hn::Min(length, rise)), s);
      found = hn::Or(found, rises);
      walking = hn::AndNot(rises, walking);
    }
    passed = hn::AndNot(hn::Lt(leaves, s_end), walking);
    progress.never = hn::Or(progress.never, passed);
    walking = hn::AndNot(passed, walking);
    s = hn::IfThenElse(walking, leaves, s);
    u = hn::Add(u, hn::IfThenElseZero(leaves_by_u, step_u));
    v = hn::Add(v, hn::IfThenZeroElse(leaves_by_u, step_v));
  }
  progress.unresolved = hn::Or(progress.unresolved, walking);
  const V sw = hn::Mul(s, p.w);
  const V t =
      hn::Add(progress.t, hn::Div(hn::Mul(sw, p.w), hn::Sub(one, hn::Mul(sw, line.w_slope))));
  progress.t = hn::IfThenElse(found, hn::Max(progress.t, t), progress.t);
}

// next_entry() of coverage_hull.cpp for the lanes together.
template <class D>
HWY_INLINE void entries_of_lanes(D d, std::span<const CoverageSimdCamera> cameras, double v_px,
                                 const double* u_px, const double* begins, const double* ends,
                                 CoverageEntry* entries) {
  using V = hn::Vec<D>;
  const V u = hn::LoadU(d, u_px), end = hn::LoadU(d, ends), one = hn::Set(d, 1.0);
  const V all = hn::Set(d, double(cameras.size()));
  const auto no_lane = hn::Lt(one, hn::Zero(d));
  Progress<D> progress{hn::LoadU(d, begins), no_lane, no_lane};
  V agreed = hn::Zero(d), camera_of = hn::Set(d, -1.0);
  for (std::size_t turn = 0; turn < kMaxRounds * cameras.size(); ++turn) {
    const auto pending =
        hn::AndNot(hn::Or(progress.never, progress.unresolved), hn::Lt(agreed, all));
    if (hn::AllFalse(d, pending)) break;
    const std::size_t i = turn % cameras.size();
    const Lines<D> line(d, cameras[i], u, v_px);
    const V before = progress.t;
    const Image<D> p(d, cameras[i], line, before);
    const auto walking = hn::AndNot(in_whole_cell(d, cameras[i], p), pending);
    if (!hn::AllFalse(d, walking)) walk_cells(d, cameras[i], line, p, end, walking, progress);
    progress.never = hn::Or(progress.never, hn::And(pending, hn::Ge(progress.t, end)));
    const auto moved = hn::Gt(progress.t, before);
    camera_of = hn::IfThenElse(moved, hn::Set(d, double(i)), camera_of);
    agreed = hn::IfThenElse(moved, one, hn::Add(agreed, one));
  }
  const auto resolved =
      hn::AndNot(progress.unresolved, hn::Or(progress.never, hn::Ge(agreed, all)));
  double ts[kMaxLanes], camera_indices[kMaxLanes], are_resolved[kMaxLanes];
  hn::StoreU(hn::IfThenElse(progress.never, hn::Set(d, kNever), progress.t), d, ts);
  hn::StoreU(camera_of, d, camera_indices);
  hn::StoreU(hn::IfThenElseZero(resolved, one), d, are_resolved);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i)
    entries[i] = {ts[i], std::int32_t(camera_indices[i]), are_resolved[i] > 0};
}

void entries(std::span<const CoverageSimdCamera> cameras, const CoverageSimdRays& rays,
             CoverageEntry* result) {
  const hn::CappedTag<double, kMaxLanes> d;
  const std::size_t lanes = hn::Lanes(d), count = rays.u_px.size();
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes)
    entries_of_lanes(d, cameras, rays.v_px, rays.u_px.data() + i, rays.begin.data() + i,
                     rays.end.data() + i, result + i);
  if (i == count) return;
  // The last lanes repeat the last ray.
  double u_px[kMaxLanes], begin[kMaxLanes], end[kMaxLanes];
  CoverageEntry last[kMaxLanes];
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const std::size_t ray = std::min(i + lane, count - 1);
    u_px[lane] = rays.u_px[ray], begin[lane] = rays.begin[ray], end[lane] = rays.end[ray];
  }
  entries_of_lanes(d, cameras, rays.v_px, u_px, begin, end, last);
  std::copy(last, last + (count - i), result + i);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::hull {
namespace {
HWY_EXPORT(entries);
}  // namespace

void simd_entries(std::span<const CoverageSimdCamera> cameras, const CoverageSimdRays& rays,
                  std::span<CoverageEntry> result) {
  assert(result.size() == rays.u_px.size());
  if (cameras.empty() || rays.u_px.empty()) return;
  HWY_DYNAMIC_DISPATCH(entries)(cameras, rays, result.data());
}

}  // namespace fivepipe::hull
#endif
