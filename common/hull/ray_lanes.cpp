#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/ray_lanes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/hull/hull.h"
#include "common/hull/ray_lanes.h"
#include "common/hull/ray_walk.h"

#ifndef FIVEPIPE_RAY_LANES_ONCE
#define FIVEPIPE_RAY_LANES_ONCE
namespace fivepipe {
namespace {

constexpr int kTilesAcross = kBlock_px / kTile_px, kTiles = kTilesAcross * kTilesAcross, kRays = kTile_px * kTile_px;
// A tile goes round the cameras, a camera is asked in a row, and a ray goes round the cameras at most so often.
constexpr int kTileRounds = 4, kTileRepeats = 6, kRayRounds = 24, kRayRepeats = 8;
// A tile that would move less than this [px] goes on ray by ray.
constexpr float kLeastTileStep_px = 0.75f;
// A divisor no smaller: what is divided by it leaves every range, and stays finite.
constexpr float kTiny = 1e-20f;
constexpr float kNotHeld = -1.0f;

}  // namespace
}  // namespace fivepipe
#endif

HWY_BEFORE_NAMESPACE();
namespace fivepipe {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, DF>;
using VF = hn::Vec<DF>;
using MF = hn::Mask<DF>;

HWY_INLINE std::uint64_t bits_of(DF d, MF mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  std::uint16_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return bits;
}
HWY_INLINE MF mask_of(DF d, std::uint64_t bits) {
  std::uint8_t bytes[8];
  std::memcpy(bytes, &bits, sizeof bits);
  return hn::LoadMaskBits(d, bytes);
}

// To 2^-22 or better on every target: Newton's step doubles the least estimate's 11 bits.
HWY_INLINE VF reciprocal(VF x) {
  const DF d;
  const VF estimate = hn::ApproximateReciprocal(x);
  return hn::Mul(estimate, hn::NegMulAdd(x, estimate, hn::Set(d, 2.0f)));
}

struct Lines {  // the images of a vector of rays in one map
  VF u0, u1, v0, v1, w0, w1;
};
HWY_INLINE Lines lines_at(const BlockCamera& c, VF i, VF j) {
  const DF d;
  const auto linear = [&](float at, float by_i, float by_j) { return hn::MulAdd(j, hn::Set(d, by_j), hn::MulAdd(i, hn::Set(d, by_i), hn::Set(d, at))); };
  return {linear(c.at_begin[0], c.du_begin[0], c.dv_begin[0]), linear(c.slope[0], c.du[0], c.dv[0]), linear(c.at_begin[1], c.du_begin[1], c.dv_begin[1]),
          linear(c.slope[1], c.du[1], c.dv[1]),               linear(c.at_begin[2], c.du_begin[2], c.dv_begin[2]), linear(c.slope[2], c.du[2], c.dv[2])};
}

struct Position {
  VF w, inverse_w, u, v;
};
HWY_INLINE Position position(const Lines& l, VF s) {
  const VF w = hn::MulAdd(s, l.w1, l.w0), inverse_w = reciprocal(w);
  return {w, inverse_w, hn::Mul(hn::MulAdd(s, l.u1, l.u0), inverse_w), hn::Mul(hn::MulAdd(s, l.v1, l.v0), inverse_w)};
}

// BorderDistance::anywhere for the pixels (fu, fv), counted from the origin.
HWY_INLINE VF distance_at(const BlockCamera& c, VF fu, VF fv) {
  const DF d;
  const DI di;
  const VF u = hn::Min(hn::Max(fu, hn::Set(d, c.least_u)), hn::Set(d, c.most_u)), v = hn::Min(hn::Max(fv, hn::Set(d, c.least_v)), hn::Set(d, c.most_v));
  const auto place = hn::ConvertTo(di, hn::MulAdd(v, hn::Set(d, c.stride), u));
  const auto word = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(c.at_origin), place);
  const VF stored = hn::ConvertTo(d, hn::ShiftRight<24>(hn::ShiftLeft<24>(word)));
  const VF beyond = hn::Max(hn::Abs(hn::Sub(fu, u)), hn::Abs(hn::Sub(fv, v)));
  return hn::IfThenElse(hn::Gt(beyond, hn::Zero(d)), hn::Add(beyond, hn::Set(d, float(BorderDistance::kMargin_px))), stored);
}

// How far the image is from the end of the box [px], on one axis and in the direction in which it moves (d/ds of the position, times
// W, is `rate`); x: position from the pixel's low border, reach: half-width of the box beyond the pixel's far border.
HWY_INLINE VF way_left(VF x, VF reach, VF rate) {
  const DF d;
  return hn::Sub(reach, hn::IfThenElse(hn::Lt(rate, hn::Zero(d)), hn::Sub(hn::Set(d, 1.0f), x), x));
}

// d/ds (U - b W) for the border b that lies `way` px ahead, its sign that of the direction: way W over it is the parameter that the
// image takes there. Tiny where it never gets there.
HWY_INLINE VF divisor(VF way, VF rate, VF w1) {
  const DF d;
  return hn::Max(hn::NegMulAdd(way, w1, hn::Abs(rate)), hn::Set(d, kTiny));
}
// --- tiles -----------------------------------------------------------------------------------------------------

struct TileStep {
  VF advance, distance;
  MF stuck;  // the tile's rays are not in one box, or it is left at once
};

// All rays of a tile lie in the box of pixels around its middle while its corners' do.
HWY_INLINE TileStep step_tiles(const BlockCamera& c, VF middle_i, VF middle_j, VF s) {
  const DF d;
  const Position middle = position(lines_at(c, middle_i, middle_j), s);
  const VF fu = hn::Floor(middle.u), fv = hn::Floor(middle.v), distance = distance_at(c, fu, fv);
  const VF reach = hn::Sub(hn::Abs(distance), hn::Set(d, kBoxMargin_px)), room = hn::Sub(reach, hn::Set(d, 1.0f));
  VF advance = hn::Set(d, 1e30f), least_way = hn::Set(d, 1e30f);
  const float half = 0.5f * float(kTile_px - 1);
  for (int corner = 0; corner < 4; ++corner) {
    const Lines l = lines_at(c, hn::Add(middle_i, hn::Set(d, corner & 1 ? half : -half)), hn::Add(middle_j, hn::Set(d, corner & 2 ? half : -half)));
    const Position p = position(l, s);
    const VF xu = hn::Sub(p.u, fu), xv = hn::Sub(p.v, fv);
    const VF rate_u = hn::NegMulAdd(p.u, l.w1, l.u1), rate_v = hn::NegMulAdd(p.v, l.w1, l.v1);
    const VF way_u = way_left(xu, reach, rate_u), way_v = way_left(xv, reach, rate_v);
    const VF behind = hn::Min(hn::Min(hn::Add(xu, room), hn::Sub(reach, xu)), hn::Min(hn::Add(xv, room), hn::Sub(reach, xv)));
    least_way = hn::Min(least_way, hn::Min(hn::Min(way_u, way_v), hn::Add(behind, hn::Set(d, kLeastTileStep_px))));
    const VF take_u = hn::Mul(way_u, reciprocal(divisor(way_u, rate_u, l.w1))), take_v = hn::Mul(way_v, reciprocal(divisor(way_v, rate_v, l.w1)));
    advance = hn::Min(advance, hn::Mul(p.w, hn::Min(take_u, take_v)));
  }
  return {advance, distance, hn::Lt(least_way, hn::Set(d, kLeastTileStep_px))};
}

// Moves each tile on while the cameras allow; s: where its rays go on, from block.begin; hold: until when a camera sees all of them on
// its object, kNotHeld where it does not. Returns the tiles that are left.
HWY_INLINE std::uint32_t march_tiles(const Block& block, float span, std::uint32_t alive, LaneScratch& scratch, float* s_of_tile) {
  const DF d;
  const int lanes = int(hn::Lanes(d)), cameras = int(block.cameras.size());
  alignas(64) float i_of_tile[kTiles], j_of_tile[kTiles];
  for (int t = 0; t < kTiles; ++t) {
    i_of_tile[t] = float(kTile_px * (t % kTilesAcross)) + 0.5f * float(kTile_px - 1);
    j_of_tile[t] = float(kTile_px * (t / kTilesAcross)) + 0.5f * float(kTile_px - 1);
  }
  std::uint32_t left = 0;
  for (int first = 0; first < kTiles; first += lanes) {
    const VF i = hn::Load(d, i_of_tile + first), j = hn::Load(d, j_of_tile + first);
    VF s = hn::Zero(d);
    MF live = mask_of(d, alive >> first);
    for (int c = 0; c < cameras; ++c) hn::Store(hn::Set(d, kNotHeld), d, scratch.tile_hold[c] + first);
    bool moved = true;
    for (int round = 0; round < kTileRounds && moved && !hn::AllFalse(d, live); ++round) {
      moved = false;
      for (int c = 0; c < cameras; ++c) {
        VF hold = hn::Load(d, scratch.tile_hold[c] + first);
        MF asked = hn::And(live, hn::Lt(hold, s));
        for (int repeat = 0; repeat < kTileRepeats && !hn::AllFalse(d, asked); ++repeat) {
          const TileStep step = step_tiles(block.cameras[c], i, j, s);
          const MF sure = hn::AndNot(step.stuck, asked), inside = hn::And(sure, hn::Lt(step.distance, hn::Zero(d)));
          hold = hn::IfThenElse(inside, hn::Add(s, step.advance), hold);
          asked = hn::AndNot(inside, sure);
          s = hn::IfThenElse(asked, hn::Add(s, step.advance), s);
          moved |= !hn::AllFalse(d, asked);
          live = hn::AndNot(hn::And(asked, hn::Gt(s, hn::Set(d, span))), live);
          asked = hn::And(asked, live);
        }
        hn::Store(hold, d, scratch.tile_hold[c] + first);
        if (hn::AllFalse(d, live)) break;
      }
    }
    hn::Store(s, d, s_of_tile + first);
    left |= std::uint32_t(bits_of(d, live)) << first;
  }
  return left;
}

// --- rays ------------------------------------------------------------------------------------------------------

struct alignas(64) RayState {
  float s[kRays], s_error[kRays];          // s_error: how far s may be from the crossing that it stands for
  float bias_u[kRays], bias_v[kRays];      // half a pixel over the border just crossed, while one camera is asked in a row
  float border[kRays];                     // the border last crossed out of a single pixel, from the camera's origin
  std::int32_t crossed[kRays];             // 2 * camera + axis; -1: none, the ray is where its tile was
};

struct StepBits {
  std::uint64_t outside, missed, unsettled;
};

HWY_INLINE StepBits step_rays(const BlockCamera& c, int camera, int first, int offset_i, int offset_j, std::uint64_t asked_bits, float span, RayState& rays, float* hold) {
  const DF d;
  const DI di;
  const VF lane = hn::Iota(d, float(first % kTile_px)), row = hn::Floor(hn::Mul(lane, hn::Set(d, 1.0f / kTile_px)));
  const VF i = hn::Add(hn::NegMulAdd(row, hn::Set(d, float(kTile_px)), lane), hn::Set(d, float(offset_i)));
  const VF j = hn::Add(row, hn::Set(d, float(offset_j + first / kTile_px)));
  const Lines l = lines_at(c, i, j);
  const VF s = hn::Load(d, rays.s + first), s_error = hn::Load(d, rays.s_error + first);
  const VF bias_u = hn::Load(d, rays.bias_u + first), bias_v = hn::Load(d, rays.bias_v + first);
  const MF asked = mask_of(d, asked_bits);
  const VF one = hn::Set(d, 1.0f), eps = hn::Set(d, c.eps_px);

  const Position p = position(l, s);
  const VF biased_u = hn::Add(p.u, bias_u), biased_v = hn::Add(p.v, bias_v);
  const VF fu = hn::Floor(biased_u), fv = hn::Floor(biased_v);
  const VF distance = distance_at(c, fu, fv), steps = hn::Abs(distance);
  const MF inside = hn::Lt(distance, hn::Zero(d)), single = hn::Lt(steps, hn::Set(d, 1.5f));
  const VF rate_u = hn::NegMulAdd(p.u, l.w1, l.u1), rate_v = hn::NegMulAdd(p.v, l.w1, l.v1);

  // Near a border behind which the verdict may differ?
  const VF error_scale = hn::Mul(s_error, p.inverse_w);
  const VF xu = hn::Sub(biased_u, fu), xv = hn::Sub(biased_v, fv);
  const MF near_u = hn::Lt(hn::Min(xu, hn::Sub(one, xu)), hn::MulAdd(hn::Abs(rate_u), error_scale, eps));
  const MF near_v = hn::Lt(hn::Min(xv, hn::Sub(one, xv)), hn::MulAdd(hn::Abs(rate_v), error_scale, eps));
  const MF unsettled = hn::And(asked, hn::And(single, hn::Or(near_u, near_v)));

  // To the end of the box. A single pixel is left exactly where it ends; as long as it is inside, a little before.
  const VF margin = hn::IfThenElse(single, hn::IfThenElseZero(inside, hn::Add(eps, eps)), hn::Set(d, kBoxMargin_px));
  const VF reach = hn::Sub(steps, margin);
  const VF way_u = hn::Max(way_left(hn::Sub(p.u, fu), reach, rate_u), hn::Zero(d)), way_v = hn::Max(way_left(hn::Sub(p.v, fv), reach, rate_v), hn::Zero(d));
  const VF per_u = reciprocal(divisor(way_u, rate_u, l.w1)), per_v = reciprocal(divisor(way_v, rate_v, l.w1));
  const VF take_u = hn::Mul(way_u, per_u), take_v = hn::Mul(way_v, per_v);
  const MF by_u = hn::Le(take_u, take_v);
  const VF next = hn::MulAdd(p.w, hn::Min(take_u, take_v), s);

  const MF agreed = hn::AndNot(unsettled, hn::And(asked, inside)), outside = hn::AndNot(unsettled, hn::AndNot(inside, asked));
  const VF held = hn::Load(d, hold + first);
  hn::Store(hn::IfThenElse(agreed, hn::Max(next, hn::Add(s, s_error)), held), d, hold + first);

  const MF crosses = hn::And(outside, single);
  const VF error = hn::IfThenElseZero(single, hn::Mul(hn::Mul(hn::Add(eps, eps), p.w), hn::IfThenElse(by_u, per_u, per_v)));
  hn::Store(hn::IfThenElse(outside, next, s), d, rays.s + first);
  hn::Store(hn::IfThenElse(outside, error, s_error), d, rays.s_error + first);
  const VF half = hn::Set(d, 0.5f);
  const VF half_u = hn::CopySign(half, rate_u), half_v = hn::CopySign(half, rate_v);
  hn::Store(hn::IfThenElseZero(hn::And(crosses, by_u), half_u), d, rays.bias_u + first);
  hn::Store(hn::IfThenZeroElse(by_u, hn::IfThenElseZero(crosses, half_v)), d, rays.bias_v + first);
  const VF border = hn::IfThenElse(by_u, hn::Add(fu, hn::Add(half_u, half)), hn::Add(fv, hn::Add(half_v, half)));
  hn::Store(hn::IfThenElse(crosses, border, hn::Load(d, rays.border + first)), d, rays.border + first);
  const auto code = hn::IfThenElse(hn::RebindMask(di, by_u), hn::Set(di, 2 * camera), hn::Set(di, 2 * camera + 1));
  hn::Store(hn::IfThenElse(hn::RebindMask(di, crosses), code, hn::Load(di, rays.crossed + first)), di, rays.crossed + first);

  const MF missed = hn::And(outside, hn::Gt(hn::Sub(next, error), hn::Set(d, span)));
  return {bits_of(d, hn::AndNot(missed, outside)), bits_of(d, missed), bits_of(d, unsettled)};
}

struct TileResult {
  std::uint64_t hit, unsettled;
};

HWY_INLINE TileResult trace_rays(const Block& block, float span, int offset_i, int offset_j, std::uint64_t active, RayState& rays, LaneScratch& scratch) {
  const DF d;
  const int lanes = int(hn::Lanes(d)), cameras = int(block.cameras.size());
  const std::uint64_t packet = (std::uint64_t{1} << lanes) - 1;
  TileResult result{0, 0};
  for (int round = 0; round < kRayRounds && active; ++round) {
    std::uint64_t moved = 0;
    for (int c = 0; c < cameras; ++c) {
      std::uint64_t asked = 0;
      for (int first = 0; first < kRays; first += lanes)
        asked |= bits_of(d, hn::Lt(hn::Load(d, scratch.hold[c] + first), hn::Add(hn::Load(d, rays.s + first), hn::Load(d, rays.s_error + first)))) << first;
      asked &= active;
      if (!asked) continue;
      std::memset(rays.bias_u, 0, sizeof rays.bias_u);
      std::memset(rays.bias_v, 0, sizeof rays.bias_v);
      for (int repeat = 0; repeat < kRayRepeats && asked; ++repeat) {
        std::uint64_t outside = 0;
        for (int first = 0; first < kRays; first += lanes) {
          const std::uint64_t chunk = asked >> first & packet;
          if (!chunk) continue;
          const StepBits bits = step_rays(block.cameras[c], c, first, offset_i, offset_j, chunk, span, rays, scratch.hold[c]);
          outside |= bits.outside << first;
          result.unsettled |= bits.unsettled << first;
          active &= ~((bits.missed | bits.unsettled) << first);
        }
        moved |= outside;
        asked = outside;
      }
    }
    result.hit |= active & ~moved;
    active &= moved;
  }
  result.unsettled |= active;
  return result;
}

// --- finish ----------------------------------------------------------------------------------------------------

// The depth of each hit from the border that it crossed last, in double: `border_crossing` in lanes.
HWY_INLINE void finish(const Block& block, int offset_i, int offset_j, TileResult& result, const RayState& rays, float* depth_m, std::ptrdiff_t pitch) {
  const hn::CappedTag<double, 8> dd;
  const hn::Rebind<float, decltype(dd)> df;
  const int lanes = int(hn::Lanes(dd));
  alignas(64) double depth[kRays];
  std::uint64_t todo = result.hit;
  while (todo) {  // all hits that crossed the same camera's border on the same axis
    const int code = rays.crossed[std::countr_zero(todo)];
    std::uint64_t same = 0;
    for (int k = 0; k < kRays; ++k) same |= std::uint64_t(rays.crossed[k] == code) << k;
    same &= todo;
    todo &= ~same;
    if (code < 0) {
      if (block.begins_at_near) {
        for (std::uint64_t m = same; m; m &= m - 1) depth[std::countr_zero(m)] = block.near;
      } else {
        result.unsettled |= same, result.hit &= ~same;
      }
      continue;
    }
    const BlockCamera& c = block.cameras[code / 2];
    const Eigen::Matrix3d& infinity = c.exact->at_infinity;
    const int axis = code % 2;
    const auto row = [&](int r) { return std::array{hn::Set(dd, infinity(r, 0)), hn::Set(dd, infinity(r, 1)), hn::Set(dd, infinity(r, 2))}; };
    const auto of_axis = row(axis), of_w = row(2);
    const auto offset = hn::Set(dd, c.exact->at_eye[axis]), w_offset = hn::Set(dd, c.exact->at_eye[2]);
    const auto origin = hn::Set(dd, double(axis ? c.origin_v_px : c.origin_u_px));
    for (int first = 0; first < kRays; first += lanes) {
      if (!(same >> first & ((1u << lanes) - 1))) continue;
      const auto u = hn::Iota(dd, block.rays.u0_px + offset_i + first % kTile_px), v = hn::Set(dd, double(block.rays.v0_px + offset_j + first / kTile_px));
      const auto slope = hn::Add(hn::Mul(of_axis[0], u), hn::Add(hn::Mul(of_axis[1], v), of_axis[2]));
      const auto w_slope = hn::Add(hn::Mul(of_w[0], u), hn::Add(hn::Mul(of_w[1], v), of_w[2]));
      const auto border = hn::Add(origin, hn::PromoteTo(dd, hn::Load(df, rays.border + first)));
      const auto t = hn::Div(hn::Sub(hn::Mul(border, w_offset), offset), hn::Sub(slope, hn::Mul(border, w_slope)));
      const std::uint64_t here = same >> first;
      alignas(64) double ts[8];
      hn::Store(t, dd, ts);
      for (int k = 0; k < lanes; ++k)
        if (here >> k & 1) depth[first + k] = ts[k];
    }
  }
  for (std::uint64_t m = result.hit; m; m &= m - 1) {
    const int k = std::countr_zero(m);
    if (!(depth[k] >= block.near)) result.unsettled |= std::uint64_t{1} << k;
    else depth_m[(k / kTile_px) * pitch + k % kTile_px] = depth[k] < block.far ? float(depth[k]) : kNoHull;
  }
}

int trace(const Block& block, LaneScratch& scratch, float* depth_m, std::ptrdiff_t pitch, std::uint16_t* unsettled) {
  const DF d;
  const int lanes = int(hn::Lanes(d)), cameras = int(block.cameras.size());
  const int width = block.rays.width_px(), height = block.rays.height_px();
  for (int v = 0; v < height; ++v) std::fill_n(depth_m + v * pitch, width, kNoHull);
  const float span = float(block.end - block.begin) * (1 + 1e-5f);
  std::uint32_t alive = 0;
  for (int t = 0; t < kTiles; ++t)
    if (kTile_px * (t % kTilesAcross) < width && kTile_px * (t / kTilesAcross) < height) alive |= 1u << t;
  alignas(64) float s_of_tile[kTiles];
  alive = march_tiles(block, span, alive, scratch, s_of_tile);
  RayState rays;
  int count = 0;
  for (; alive; alive &= alive - 1) {
    const int tile = std::countr_zero(alive), offset_i = kTile_px * (tile % kTilesAcross), offset_j = kTile_px * (tile / kTilesAcross);
    std::uint64_t active = 0;
    const int columns = std::min(kTile_px, width - offset_i);
    for (int row = 0; row < std::min(kTile_px, height - offset_j); ++row) active |= ((std::uint64_t{1} << columns) - 1) << (row * kTile_px);
    for (int first = 0; first < kRays; first += lanes) {
      hn::Store(hn::Set(d, s_of_tile[tile]), d, rays.s + first);
      hn::Store(hn::Zero(d), d, rays.s_error + first);
      hn::Store(hn::Set(DI(), -1), DI(), rays.crossed + first);
    }
    for (int c = 0; c < cameras; ++c)
      for (int first = 0; first < kRays; first += lanes) hn::Store(hn::Set(d, scratch.tile_hold[c][tile]), d, scratch.hold[c] + first);
    TileResult result = trace_rays(block, span, offset_i, offset_j, active, rays, scratch);
    if (result.hit) finish(block, offset_i, offset_j, result, rays, depth_m + offset_j * pitch + offset_i, pitch);
    for (std::uint64_t m = result.unsettled; m; m &= m - 1) {
      const int k = std::countr_zero(m);
      unsettled[count++] = std::uint16_t((offset_j + k / kTile_px) * kBlock_px + offset_i + k % kTile_px);
    }
  }
  return count;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe {
namespace {
HWY_EXPORT(trace);

// The rounding of a position [px], eight operations of float each way: coefficients from double, two steps to the ray, one along it,
// for both parts of the quotient, and the reciprocal's own. Terms are bounded by their largest in the block.
constexpr double kRoundings = 12, kHalfUlp = 0x1p-24;

}  // namespace

bool prepare(Block& block, std::span<const MapFromView> maps, std::span<const BorderDistance* const> borders) {
  const double begin = block.begin, span = block.end - block.begin;
  // Whole tiles: the rays at their corners stand for all.
  const auto last = [](int size) { return (size + kTile_px - 1) / kTile_px * kTile_px - 1; };
  const int right = last(block.rays.width_px()), down = last(block.rays.height_px());
  block.cameras.resize(maps.size());
  for (std::size_t n = 0; n < maps.size(); ++n) {
    const MapFromView& map = maps[n];
    const PixelRect& stored = borders[n]->stored();
    BlockCamera& c = block.cameras[n];
    c.exact = &map;
    Eigen::Matrix3d turn = map.at_infinity;
    Eigen::Vector3d eye = map.at_eye;
    // Pixels count from where the block's middle ray begins, if that is in store.
    const Eigen::Vector3d middle = eye + begin * turn * Eigen::Vector3d(block.rays.u0_px + 0.5 * right, block.rays.v0_px + 0.5 * down, 1);
    const auto origin = [](double at, int least, int most) { return !(at > least) ? least : at >= most ? most : int(at); };
    c.origin_u_px = origin(middle.x() / middle.z(), stored.u0_px, stored.u1_px - 1);
    c.origin_v_px = origin(middle.y() / middle.z(), stored.v0_px, stored.v1_px - 1);
    turn.row(0) -= c.origin_u_px * turn.row(2);
    turn.row(1) -= c.origin_v_px * turn.row(2);
    eye.head<2>() -= Eigen::Vector2d(c.origin_u_px, c.origin_v_px) * eye.z();
    const Eigen::Vector3d slope = turn * Eigen::Vector3d(block.rays.u0_px, block.rays.v0_px, 1), at_begin = eye + begin * slope;
    double least_w = kNever, most_w = 0, most_uv = 0;
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector3d of_corner = (corner & 1 ? right : 0) * turn.col(0) + (corner & 2 ? down : 0) * turn.col(1);
      const Eigen::Vector3d corner_slope = slope + of_corner, corner_begin = at_begin + begin * of_corner;
      least_w = std::min({least_w, corner_begin.z(), corner_begin.z() + span * corner_slope.z()});
      const Eigen::Array3d size = corner_begin.array().abs() + span * corner_slope.array().abs();
      most_w = std::max(most_w, size.z());
      most_uv = std::max({most_uv, size.x(), size.y()});
    }
    if (!(least_w > 0)) return false;
    const double eps = kRoundings * kHalfUlp * (most_uv / least_w) * (1 + most_w / least_w);
    if (!(eps < kMostEps_px)) return false;
    for (int k = 0; k < 3; ++k) {
      c.at_begin[k] = float(at_begin[k]);
      c.slope[k] = float(slope[k]);
      c.du[k] = float(turn(k, 0));
      c.dv[k] = float(turn(k, 1));
      c.du_begin[k] = float(begin * turn(k, 0));
      c.dv_begin[k] = float(begin * turn(k, 1));
    }
    c.least_u = float(stored.u0_px - c.origin_u_px), c.most_u = float(stored.u1_px - 1 - c.origin_u_px);
    c.least_v = float(stored.v0_px - c.origin_v_px), c.most_v = float(stored.v1_px - 1 - c.origin_v_px);
    c.stride = float(borders[n]->stride());
    c.eps_px = float(eps);
    c.at_origin = borders[n]->bytes() + std::ptrdiff_t(c.origin_v_px - stored.v0_px) * borders[n]->stride() + (c.origin_u_px - stored.u0_px);
  }
  return true;
}

int trace_block(const Block& block, LaneScratch& scratch, float* depth_m, std::ptrdiff_t pitch, std::uint16_t* unsettled) {
  return HWY_DYNAMIC_DISPATCH(trace)(block, scratch, depth_m, pitch, unsettled);
}

}  // namespace fivepipe
#endif
