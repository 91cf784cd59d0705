// Image-based visual hulls with SIMD: a block of neighbouring rays, four wide, moves from camera to
// camera.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "benchmarks/hull/baselines/image_based_hull_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "benchmarks/hull/baselines/image_based_hull.h"
#include "benchmarks/hull/baselines/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines::HWY_NAMESPACE {
constexpr float kNever = std::numeric_limits<float>::infinity();
// The smallest relative step in depth. It leaves an interval that is thinner than the rounding of
// its ends, which would otherwise be returned again.
constexpr float kMinStep = 1 + 2 * std::numeric_limits<float>::epsilon();

// A block's rays in one camera: the epipolar line of each, its direction, and the edges that it may
// cross.
struct Lines {
  V a_eye, a_far, w_eye, w_far;  // position on the line: (a_eye + t a_far) / (w_eye + t w_far)
  V towards;
  // For an edge along a, at border b: towards * a = b * along_scale + along_offset.
  V along_scale, along_offset;
  VI whole_begin, whole_count, part_begin, part_count;
  VI step;  // of the bin
};

HWY_INLINE V homogeneous(const EpipolarCamera& c, std::size_t k, V u, V v) {
  return hn::MulAdd(hn::Set(d, c.of_u[k]), u,
                    hn::MulAdd(hn::Set(d, c.of_v[k]), v, hn::Set(d, c.of_1[k])));
}

HWY_INLINE Lines lines_of(const EpipolarCamera& c, V u, V v) {
  const V x = homogeneous(c, 0, u, v), y = homogeneous(c, 1, u, v), w = homogeneous(c, 2, u, v);
  const V zero = hn::Zero(d);
  Lines l{zero,
          zero,
          hn::Set(d, c.at_eye[2]),
          w,
          hn::Set(d, 1.0f),
          zero,
          zero,
          hn::Zero(di),
          hn::Zero(di),
          hn::Zero(di),
          hn::Zero(di),
          hn::Zero(di)};
  VI all_steps = hn::Set(di, c.empty_bin * kStepsPerBin);
  for (const Sector& sector : c.sectors) {
    const V a = sector.advances_along_y ? y : x, b = sector.advances_along_y ? x : y;
    const V p0 = hn::Set(d, sector.p0), p1 = hn::Set(d, sector.p1), q0 = hn::Set(d, sector.q0),
            q1 = hn::Set(d, sector.q1);
    const V ahead = hn::MulAdd(p1, a, hn::Mul(p0, w));
    const V s = hn::Mul(hn::NegMulAdd(q1, a, hn::NegMulAdd(q0, w, b)), reciprocal(ahead));
    const V from = hn::Sub(s, hn::Set(d, sector.s_begin));
    const M here = hn::And(hn::Gt(ahead, zero),
                           hn::And(hn::Ge(from, zero), hn::Lt(s, hn::Set(d, sector.s_end))));
    if (hn::AllFalse(d, here)) continue;
    const V towards = hn::Set(d, sector.towards);
    const V scale = hn::Mul(towards, reciprocal(hn::MulAdd(s, p1, q1)));
    const VI steps = hn::Min(hn::ConvertTo(di, hn::Mul(from, hn::Set(d, sector.steps_per_s))),
                             hn::Set(di, sector.bins * kStepsPerBin - 1));
    all_steps =
        hn::IfThenElse(hn::RebindMask(di, here),
                       hn::Add(steps, hn::Set(di, sector.first_bin * kStepsPerBin)), all_steps);
    l.a_eye = hn::IfThenElse(here, hn::Set(d, c.at_eye[sector.advances_along_y ? 1 : 0]), l.a_eye);
    l.a_far = hn::IfThenElse(here, a, l.a_far);
    l.towards = hn::IfThenElse(here, towards, l.towards);
    l.along_scale = hn::IfThenElse(here, scale, l.along_scale);
    l.along_offset =
        hn::IfThenElse(here, hn::Neg(hn::Mul(hn::MulAdd(s, p0, q0), scale)), l.along_offset);
  }
  const VI bin = hn::ShiftRight<kStepBits>(all_steps);
  l.step = hn::And(all_steps, hn::Set(di, kStepsPerBin - 1));
  l.whole_begin = hn::GatherIndex(di, c.whole_first, bin);
  l.whole_count = hn::Sub(hn::GatherIndex(di, c.whole_first + 1, bin), l.whole_begin);
  l.part_begin = hn::GatherIndex(di, c.part_first, bin);
  l.part_count = hn::Sub(hn::GatherIndex(di, c.part_first + 1, bin), l.part_begin);
  return l;
}

// The result of one pass over a ray's edges: whether an odd number of them is beyond a position,
// and the nearest two of these.
struct Beyond {
  M odd;
  V first, second;
};

// Only the low 16 bits of `edge` are used.
HWY_INLINE void meet(const Lines& l, V position, VI edge, M counted, Beyond& beyond) {
  const V border = hn::ConvertTo(d, hn::ShiftRight<17>(hn::ShiftLeft<16>(edge)));
  const M along = as_float_mask(hn::TestBit(edge, hn::Set(di, 1)));
  const V at = hn::IfThenElse(along, hn::MulAdd(border, l.along_scale, l.along_offset), border);
  const M is_beyond = hn::And(counted, hn::Gt(at, position));
  const V it = hn::IfThenElse(is_beyond, at, hn::Set(d, kNever));
  beyond.odd = hn::Xor(beyond.odd, is_beyond);
  beyond.second = hn::Min(beyond.second, hn::Max(beyond.first, it));
  beyond.first = hn::Min(beyond.first, it);
}

HWY_INLINE Beyond edges_beyond(const EpipolarCamera& c, const Lines& l, M active, V position) {
  Beyond beyond{hn::Lt(hn::Zero(d), hn::Zero(d)), hn::Set(d, kNever), hn::Set(d, kNever)};
  const VI none = hn::Set(di, -1);
  const VI whole_count = hn::IfThenElse(hn::RebindMask(di, active), l.whole_count, none),
           part_count = hn::IfThenElse(hn::RebindMask(di, active), l.part_count, none);
  for (VI i = hn::Zero(di);; i = hn::Add(i, hn::Set(di, 1))) {
    const M has = as_float_mask(hn::Lt(i, whole_count));
    if (hn::AllFalse(d, has)) break;
    const VI edges = hn::GatherIndex(di, c.whole, hn::Add(l.whole_begin, i));
    meet(l, position, edges, has, beyond);
    meet(l, position, hn::ShiftRight<16>(edges), has, beyond);
  }
  for (VI i = hn::Zero(di);; i = hn::Add(i, hn::Set(di, 1))) {
    const M has = as_float_mask(hn::Lt(i, part_count));
    if (hn::AllFalse(d, has)) break;
    const VI at = hn::Add(l.part_begin, i),
             steps = hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(c.part_steps), at);
    const VI edges = hn::GatherIndex(di, c.part, at);
    // The upper half is unsigned and at most kStepsPerBin = 1 << 15.
    const VI begin = hn::And(steps, hn::Set(di, 0xffff)),
             end = hn::And(hn::ShiftRight<16>(steps), hn::Set(di, 0xffff));
    const M crossed = as_float_mask(hn::AndNot(hn::Lt(l.step, begin), hn::Lt(l.step, end)));
    meet(l, position, edges, hn::And(has, crossed), beyond);
  }
  return beyond;
}

// Returns the depth at which the image reaches a position on its line; kNever if the position is
// beyond the vanishing point.
HWY_INLINE V depth_at(const Lines& l, V position) {
  const V a = hn::Mul(position, l.towards);
  const V ahead =
      hn::NegMulAdd(a, l.w_far, l.a_far);  // has the sign of `towards` before the vanishing point
  const V t = hn::Mul(hn::MulSub(a, l.w_eye, l.a_eye), reciprocal(ahead));
  const M reached =
      hn::And(hn::Gt(hn::Mul(ahead, l.towards), hn::Zero(d)), hn::Lt(position, hn::Set(d, kNever)));
  return hn::IfThenElse(reached, t, hn::Set(d, kNever));
}

// The interval inside the silhouette that contains t, or the next one.
struct Interval {
  V enter, leave;
};
HWY_INLINE Interval interval_from(const EpipolarCamera& c, const Lines& l, M active, V t) {
  const V w = hn::MulAdd(t, l.w_far, l.w_eye);
  const V a = hn::Mul(hn::MulAdd(t, l.a_far, l.a_eye), reciprocal(w));
  const V least = hn::Set(d, kMinPosition);
  const V position =
      hn::IfThenElse(hn::Gt(w, hn::Zero(d)), hn::Max(hn::Mul(a, l.towards), least), least);
  const Beyond beyond = edges_beyond(c, l, active, position);
  const M inside = c.ends_inside ? hn::Not(beyond.odd) : beyond.odd;
  const V enter = hn::IfThenElse(inside, t, hn::Max(t, depth_at(l, beyond.first)));
  return {enter, depth_at(l, hn::IfThenElse(inside, beyond.first, beyond.second))};
}

// The cameras whose last interval a block remembers; it tests the others in every round.
constexpr std::size_t kMaxRememberedCameras = 64;

// Returns whether some ray of the tile starts or ends behind a camera.
bool leaves_front(std::span<const EpipolarCamera> cameras, const EpipolarTile& tile) {
  for (const EpipolarCamera& c : cameras)
    for (const int u : {tile.rays.u0_px, tile.rays.u1_px})
      for (const int v : {tile.rays.v0_px, tile.rays.v1_px}) {
        const float w_far = c.of_u[2] * float(u) + c.of_v[2] * float(v) + c.of_1[2];
        if (!(c.at_eye[2] + tile.begin_m * w_far > 0 && c.at_eye[2] + tile.end_m * w_far > 0))
          return true;
      }
  return false;
}

// Clips a block's rays to their part in front of every camera.
void clip_to_front(std::span<const EpipolarCamera> cameras, V u, V v, V& begin, V& end) {
  for (const EpipolarCamera& c : cameras) {
    const V w_eye = hn::Set(d, c.at_eye[2]), w_far = homogeneous(c, 2, u, v);
    const V turn = hn::Div(hn::Neg(w_eye), w_far);
    begin = hn::IfThenElse(hn::And(hn::Gt(w_far, hn::Zero(d)), hn::Lt(w_eye, hn::Zero(d))),
                           hn::Max(begin, turn), begin);
    end = hn::IfThenElse(hn::Lt(w_far, hn::Zero(d)), hn::Min(end, turn), end);
  }
}

HWY_INLINE V trace_block(std::span<const EpipolarCamera> cameras, const EpipolarTile& tile,
                         bool clipped, V u, V v, M alive) {
  V t = hn::Set(d, tile.begin_m), end = hn::Set(d, tile.end_m);
  if (clipped) clip_to_front(cameras, u, v, t, end);
  V until[kMaxRememberedCameras];
  const std::size_t remembered = std::min(cameras.size(), kMaxRememberedCameras);
  for (std::size_t c = 0; c < remembered; ++c) until[c] = hn::Set(d, -kNever);
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const M active = c < remembered ? hn::And(alive, hn::Ge(t, until[c])) : alive;
      if (hn::AllFalse(d, active)) continue;
      const Interval interval = interval_from(cameras[c], lines_of(cameras[c], u, v), active, t);
      const M on = hn::And(active, hn::Gt(interval.enter, t));
      if (c < remembered) {
        until[c] = hn::IfThenElse(
            active, hn::Max(interval.leave, hn::Mul(interval.enter, hn::Set(d, kMinStep))),
            until[c]);
        moved = true;
      } else {
        moved |= !hn::AllFalse(d, on);
      }
      t = hn::IfThenElse(active, interval.enter, t);
      alive = hn::And(alive, hn::Lt(t, end));
      if (hn::AllFalse(d, alive)) return hn::Set(d, hull::kNoHull);
    }
  }
  return hn::IfThenElse(alive, t, hn::Set(d, hull::kNoHull));
}

void trace_tile(std::span<const EpipolarCamera> cameras, const EpipolarTile& tile) {
  constexpr int kWide = 4;
  const int lanes = int(hn::Lanes(d)), wide = std::min(kWide, lanes), high = lanes / wide;
  HWY_ALIGN float us[16], vs[16], depths[16];
  const hull::PixelRect& rays = tile.rays;
  const bool clipped = leaves_front(cameras, tile);
  for (int v0 = rays.v0_px; v0 < rays.v1_px; v0 += high)
    for (int u0 = rays.u0_px; u0 < rays.u1_px; u0 += wide) {
      for (int i = 0; i < lanes; ++i) {
        us[i] = float(u0 + i % wide);
        vs[i] = float(v0 + i / wide);
      }
      const V u = hn::Load(d, us), v = hn::Load(d, vs);
      const M alive = hn::And(hn::Lt(u, hn::Set(d, float(rays.u1_px))),
                              hn::Lt(v, hn::Set(d, float(rays.v1_px))));
      hn::Store(trace_block(cameras, tile, clipped, u, v, alive), d, depths);
      for (int y = 0; y < high && v0 + y < rays.v1_px; ++y)
        std::copy_n(
            depths + y * wide, std::min(wide, rays.u1_px - u0),
            tile.depth_m + std::size_t(v0 + y - rays.v0_px) * tile.stride + (u0 - rays.u0_px));
    }
}

// In the functions below, the lanes hold tiles.

// Bound on the relative rounding of float depths.
constexpr float kRounding = 1e-6f;

constexpr int kCorners = 4;
// The rays at the tiles' corners; the positions of the other rays are between theirs.
struct CornerRays {
  V u[kCorners], v[kCorners];
};

HWY_INLINE void narrow(const EpipolarCamera& c, const CornerRays& corners, V& begin, V& end) {
  const Sector& sector = c.sectors[0];
  const std::size_t axis_a = sector.advances_along_y ? 1 : 0;
  const V never = hn::Set(d, kNever), towards = hn::Set(d, sector.towards);
  V s_min = never, s_max = hn::Neg(never), w_far[kCorners], a_far[kCorners];
  M ahead = hn::Eq(never, never);
  for (int k = 0; k < kCorners; ++k) {
    w_far[k] = homogeneous(c, 2, corners.u[k], corners.v[k]);
    a_far[k] = homogeneous(c, axis_a, corners.u[k], corners.v[k]);
    const V b = homogeneous(c, 1 - axis_a, corners.u[k], corners.v[k]);
    const V den =
        hn::MulAdd(hn::Set(d, sector.p1), a_far[k], hn::Mul(hn::Set(d, sector.p0), w_far[k]));
    const V s = hn::Mul(hn::NegMulAdd(hn::Set(d, sector.q1), a_far[k],
                                      hn::NegMulAdd(hn::Set(d, sector.q0), w_far[k], b)),
                        reciprocal(den));
    ahead = hn::And(ahead, hn::Gt(den, hn::Zero(d)));
    s_min = hn::Min(s_min, s);
    s_max = hn::Max(s_max, s);
  }
  const V slack = hn::Set(d, kRounding_px), s_begin = hn::Set(d, sector.s_begin),
          groups_per_s = hn::Set(d, sector.steps_per_s / (kStepsPerBin * kGroupBins));
  const auto group = [&](V s) HWY_ATTR {
    const V g = hn::Mul(hn::Sub(s, s_begin), groups_per_s);
    return hn::ConvertTo(di, hn::Min(hn::Max(g, hn::Zero(d)), hn::Set(d, float(c.groups - 1))));
  };
  s_min = hn::Sub(s_min, slack);
  s_max = hn::Add(s_max, slack);
  const M meets = hn::And(hn::Ge(s_max, s_begin), hn::Lt(s_min, hn::Set(d, sector.s_end)));
  const VI one = hn::Set(di, 1), first = group(s_min),
           group_end = hn::Add(hn::Max(group(s_max), first), one);
  // The largest power of two in the range, from the exponent of a float.
  const VI level =
      hn::Sub(hn::ShiftRight<23>(hn::BitCast(di, hn::ConvertTo(d, hn::Sub(group_end, first)))),
              hn::Set(di, 127));
  const VI row = hn::Mul(level, hn::Set(di, c.groups)), at = hn::Add(row, first),
           other_at = hn::Add(row, hn::Sub(group_end, hn::Shl(one, level)));
  const V nearest = hn::Sub(
      hn::Min(hn::GatherIndex(d, c.nearest, at), hn::GatherIndex(d, c.nearest, other_at)), slack);
  const V farthest = hn::Add(
      hn::Max(hn::GatherIndex(d, c.farthest, at), hn::GatherIndex(d, c.farthest, other_at)), slack);
  V min_depth = never, max_depth = hn::Zero(d);
  for (int k = 0; k < kCorners; ++k) {
    Lines l;
    l.a_eye = hn::Set(d, c.at_eye[axis_a]);
    l.a_far = a_far[k];
    l.w_eye = hn::Set(d, c.at_eye[2]);
    l.w_far = w_far[k];
    l.towards = towards;
    min_depth = hn::Min(min_depth, depth_at(l, nearest));
    max_depth = hn::Max(max_depth, depth_at(l, farthest));
  }
  begin =
      hn::IfThenElse(ahead, hn::Max(begin, hn::Mul(min_depth, hn::Set(d, 1 - kRounding))), begin);
  end = hn::IfThenElse(
      ahead, hn::IfThenElseZero(meets, hn::Min(end, hn::Mul(max_depth, hn::Set(d, 1 + kRounding)))),
      end);
}

void narrow_tiles(std::span<const EpipolarCamera> cameras, const hull::PixelRect& piece,
                  float begin_m, float end_m, TileRanges& ranges) {
  const int lanes = int(hn::Lanes(d));
  for (int first = 0; first < kTilesAcross * kTilesAcross; first += lanes) {
    const VI i = hn::Iota(di, first);
    const V u = hn::ConvertTo(
        d, hn::Add(hn::Mul(hn::And(i, hn::Set(di, kTilesAcross - 1)), hn::Set(di, kTile_px)),
                   hn::Set(di, piece.u0_px)));
    const V v = hn::ConvertTo(
        d, hn::Add(hn::Mul(hn::ShiftRight<kTilesAcrossBits>(i), hn::Set(di, kTile_px)),
                   hn::Set(di, piece.v0_px)));
    const V u_last = hn::Add(u, hn::Set(d, float(kTile_px - 1))),
            v_last = hn::Add(v, hn::Set(d, float(kTile_px - 1)));
    const CornerRays corners{{u, u_last, u, u_last}, {v, v, v_last, v_last}};
    V begin = hn::Set(d, begin_m), end = hn::Set(d, end_m);
    for (const EpipolarCamera& c : cameras)
      if (c.groups > 0) narrow(c, corners, begin, end);
    const M in_piece = hn::And(hn::Lt(u, hn::Set(d, float(piece.u1_px))),
                               hn::Lt(v, hn::Set(d, float(piece.v1_px))));
    hn::StoreU(begin, d, ranges.begin_m + first);
    hn::StoreU(hn::IfThenElseZero(in_piece, end), d, ranges.end_m + first);
  }
}

}  // namespace fivepipe::baselines::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::baselines {
HWY_EXPORT(trace_tile);
HWY_EXPORT(narrow_tiles);
void narrow_tiles(std::span<const EpipolarCamera> cameras, const hull::PixelRect& piece,
                  float begin_m, float end_m, TileRanges& ranges) {
  HWY_DYNAMIC_DISPATCH(narrow_tiles)(cameras, piece, begin_m, end_m, ranges);
}
void trace_tile(std::span<const EpipolarCamera> cameras, const EpipolarTile& tile) {
  HWY_DYNAMIC_DISPATCH(trace_tile)(cameras, tile);
}
}  // namespace fivepipe::baselines
#endif
