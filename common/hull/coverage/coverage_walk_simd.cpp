#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/coverage/coverage_walk_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cassert>

#include "common/hull/coverage/coverage_walk.h"
#include "common/hull/coverage/coverage_walk_simd.h"
#include "common/hull/map_from_view.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// On the benchmark's rigs 12 of 13 rays enter the hull within these cells per silhouette and these
// rounds.
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

// The lines of the rays' images from a point on (CoverageWalk::start()).
template <class D, class V = hn::Vec<D>>
struct Track {
  V du, dv, per_du, per_dv, s_end;
  hn::Mask<D> right, down;
  hn::Mask<D> moves;  // along both axes, by more than rounding

  HWY_INLINE Track(D d, const CoverageSimdCamera& c, const Lines<D>& line, const Image<D>& p, V t,
                   V end) {
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0), half = hn::Set(d, 0.5);
    right = hn::Gt(hn::Mul(line.u_slope, line.w_offset), hn::Mul(line.u_offset, line.w_slope));
    down = hn::Gt(hn::Mul(line.v_slope, line.w_offset), hn::Mul(line.v_offset, line.w_slope));
    du = hn::Mul(p.w, hn::Sub(line.u_slope, hn::Mul(p.u, line.w_slope)));
    dv = hn::Mul(p.w, hn::Sub(line.v_slope, hn::Mul(p.v, line.w_slope)));
    const auto is_still =
        hn::Or(hn::Or(hn::Eq(du, zero), hn::Eq(dv, zero)),
               hn::Or(hn::Xor(right, hn::Gt(du, zero)), hn::Xor(down, hn::Gt(dv, zero))));
    moves = hn::Not(is_still);
    per_du = hn::Div(one, du);
    per_dv = hn::Div(one, dv);
    const V end_w = line.w_at(end), end_of_range = hn::Div(hn::Sub(end, t), hn::Mul(p.w, end_w)),
            image_u = hn::IfThenElse(right, hn::Set(d, c.width_cells - 0.5), half),
            image_v = hn::IfThenElse(down, hn::Set(d, c.height_cells - 0.5), half);
    s_end = hn::IfThenElse(hn::Gt(end_w, hn::Set(d, kNearestToCamera_m)), end_of_range,
                           hn::Set(d, kNever));
    s_end = hn::Min(s_end, hn::Min(hn::Mul(hn::Sub(image_u, p.u), per_du),
                                   hn::Mul(hn::Sub(image_v, p.v), per_dv)));
  }
};

// Coverage - one half in a cell by the distance from s (CoverageWalk::entry_in_cell()).
template <class D, class V = hn::Vec<D>>
struct Quadratic {
  D d;
  V constant, linear, square;

  // (x, y): the position in the cell at s.
  HWY_INLINE Quadratic(D tag, const Corners<D>& c, const Track<D>& track, V x, V y) : d(tag) {
    const V by_u = hn::Sub(c.s10, c.s00), by_v = hn::Sub(c.s01, c.s00),
            by_uv = hn::Add(hn::Sub(hn::Sub(c.s00, c.s10), c.s01), c.s11);
    constant =
        hn::Add(hn::Add(c.s00, hn::Mul(by_u, x)), hn::Mul(hn::Add(by_v, hn::Mul(by_uv, x)), y));
    linear = hn::Add(hn::Add(hn::Mul(by_u, track.du), hn::Mul(by_v, track.dv)),
                     hn::Mul(by_uv, hn::Add(hn::Mul(x, track.dv), hn::Mul(y, track.du))));
    square = hn::Mul(hn::Mul(by_uv, track.du), track.dv);
  }
  // first_rise() of coverage_walk.cpp. Returns the lanes that rise, and sets their `rise`.
  HWY_INLINE hn::Mask<D> rises(hn::Mask<D> walking, V length, V& rise) const {
    const V zero = hn::Zero(d), twice_square = hn::Add(square, square);
    const V at_end = hn::Add(constant, hn::Mul(length, hn::Add(linear, hn::Mul(length, square))));
    const auto is_positive = hn::Gt(linear, zero);
    const auto has_maximum =
        hn::And(is_positive, hn::Lt(hn::Add(linear, hn::Mul(twice_square, length)), zero));
    auto rising = hn::And(walking, hn::Or(hn::Gt(at_end, zero), has_maximum));
    if (hn::AllFalse(d, rising)) return rising;
    const V discriminant =
        hn::Sub(hn::Mul(linear, linear), hn::Mul(hn::Add(twice_square, twice_square), constant));
    rising = hn::And(rising, hn::Gt(discriminant, zero));
    const V root = hn::Sqrt(hn::IfThenElseZero(rising, discriminant));
    const V from = hn::IfThenElse(is_positive, hn::Neg(hn::Add(constant, constant)),
                                  hn::Sub(root, linear)),
            by = hn::IfThenElse(is_positive, hn::Add(linear, root), twice_square);
    rise = hn::Min(length, hn::Div(from, by));
    return rising;
  }
};

// Where the lanes' rays are.
template <class D, class V = hn::Vec<D>>
struct Progress {
  V t;
  hn::Mask<D> never;       // outside of a silhouette up to the end
  hn::Mask<D> unresolved;  // left to CoverageWalk
};

// Adds the lanes of `from` that are not in `rest` to `to`. Returns those in both.
template <class M>
HWY_INLINE M leave(M from, M rest, M& to) {
  to = hn::Or(to, hn::AndNot(rest, from));
  return hn::And(from, rest);
}

// CoverageWalk::walk() for the lanes of `walking`, whose image is p. In all others, and in lanes
// that become unresolved, t stays.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void walk_cells(D d, const CoverageSimdCamera& c, const Lines<D>& line,
                           const Image<D>& p, V end, hn::Mask<D> walking, Progress<D>& progress) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0), uncertain = hn::Set(d, kUncertainSide);
  const Track<D> track(d, c, line, p, progress.t, end);
  // CoverageWalk takes the rays whose image begins later, and those whose image does not move.
  walking = leave(walking, hn::And(p.is_seen, track.moves), progress.unresolved);
  const V past_u = hn::IfThenElseZero(track.right, one),
          past_v = hn::IfThenElseZero(track.down, one);
  const V step_u = hn::IfThenElse(track.right, one, hn::Neg(one)),
          step_v = hn::IfThenElse(track.down, one, hn::Neg(one));
  V s = zero, u = hn::Floor(p.u), v = hn::Floor(p.v);
  auto found = hn::AndNot(walking, walking);  // no lane
  walking = leave(walking, hn::Lt(s, track.s_end), progress.never);
  for (int cell = 0; cell < kMaxCells && !hn::AllFalse(d, walking); ++cell) {
    const V at_u = hn::Mul(hn::Sub(hn::Add(u, past_u), p.u), track.per_du),
            at_v = hn::Mul(hn::Sub(hn::Add(v, past_v), p.v), track.per_dv);
    const auto leaves_by_u = hn::Le(at_u, at_v);
    const V leaves = hn::Max(s, hn::IfThenElse(leaves_by_u, at_u, at_v));
    const Quadratic<D> f(d, Corners<D>(d, c, u, v, walking), track,
                         hn::Sub(hn::Add(p.u, hn::Mul(s, track.du)), u),
                         hn::Sub(hn::Add(p.v, hn::Mul(s, track.dv)), v));
    walking = leave(walking, hn::Gt(hn::Abs(f.constant), uncertain), progress.unresolved);
    walking = leave(walking, hn::Lt(f.constant, zero), found);
    V rise = zero;
    const auto rises = f.rises(walking, hn::Sub(hn::Min(leaves, track.s_end), s), rise);
    s = hn::IfThenElse(rises, hn::Add(s, rise), s);
    walking = leave(walking, hn::Not(rises), found);
    walking = leave(walking, hn::Lt(leaves, track.s_end), progress.never);
    s = hn::IfThenElse(walking, leaves, s);
    u = hn::Add(u, hn::IfThenElseZero(leaves_by_u, step_u));
    v = hn::Add(v, hn::IfThenZeroElse(leaves_by_u, step_v));
  }
  progress.unresolved = hn::Or(progress.unresolved, walking);
  // CoverageWalk::t_of()
  const V sw = hn::Mul(s, p.w);
  const V t =
      hn::Add(progress.t, hn::Div(hn::Mul(sw, p.w), hn::Sub(one, hn::Mul(sw, line.w_slope))));
  progress.t = hn::IfThenElse(found, hn::Max(progress.t, t), progress.t);
}

// next_entry() for the lanes together.
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
  hn::StoreU(hn::IfThenElse(progress.never, hn::Set(d, -1.0), camera_of), d, camera_indices);
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

CoverageSimdCamera::CoverageSimdCamera(const MapFromView& map_from_view, const WalkedMap& walked)
    : whole_cells(walked.whole_cells.words().data()),
      words_per_row(walked.whole_cells.words_per_row()),
      width_cells(walked.whole_cells.width_px()),
      height_cells(walked.whole_cells.height_px()),
      coverage(walked.coverage.data()),
      u0_px(walked.corners.u0_px),
      v0_px(walked.corners.v0_px),
      width_px(walked.corners.width_px()),
      height_px(walked.corners.height_px()) {
  for (int i = 0; i < 3; ++i) at_eye[i] = map_from_view.at_eye[i];
  for (int i = 0; i < 9; ++i) at_infinity[i] = map_from_view.at_infinity(i / 3, i % 3);
}

void simd_entries(std::span<const CoverageSimdCamera> cameras, const CoverageSimdRays& rays,
                  std::span<CoverageEntry> result) {
  assert(result.size() == rays.u_px.size());
  if (cameras.empty() || rays.u_px.empty()) return;
  HWY_DYNAMIC_DISPATCH(entries)(cameras, rays, result.data());
}

}  // namespace fivepipe::hull
#endif
