#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/cpu/ray_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "common/hull/cpu/block_simd-inl.h"
#include "common/hull/cpu/ray_simd.h"
#include "common/hull/cpu/ray_walk.h"
#include "common/hull/cpu/tile_simd-inl.h"
#include "common/hull/hull.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

constexpr int kTileRays = kSmallTile_px * kSmallTile_px;
// A ray goes round the cameras, and a camera is asked in a row, at most so often.
constexpr int kRayRounds = 24, kRayRepeats = 8;
// An image further past its end of a box than this is past all that is in store [px]: else it is in
// the box, but for its error.
constexpr float kPastExtent_px = -0.5f;
// By how much rounding may shorten the block's range, and a way within it, as fractions: some
// operations of float each.
constexpr float kSpanSlack = 1e-5f, kPathError = 1e-6f;

// --- rays
// ------------------------------------------------------------------------------------------------------

// The border that a ray crossed last is of 2 * camera + axis.
constexpr std::int32_t kNoBorder = -1;

struct StepBits {
  std::uint32_t outside, missed, uncertain;
};

// Asks one camera about a vector of rays, those of asked_bits: agreed, or moved on. i, j: in the
// block.
template <bool kBothWays>
HWY_INLINE StepBits step_rays(const BlockCamera& c, int camera, VF i, VF j,
                              std::uint32_t asked_bits, float span, float* s_at, float* s_error_at,
                              std::int32_t* crossed_at, float* border_at, float* hold_at) {
  const DF d;
  const DI di;
  const Lines l = lines_at(c, i, j);
  const VF s = hn::Load(d, s_at), s_error = hn::Load(d, s_error_at);
  const auto crossed = hn::Load(di, crossed_at);
  const MF asked = mask_of(d, asked_bits);
  const VF zero = hn::Zero(d), half = hn::Set(d, 0.5f),
           eps = hn::MulAdd(s, hn::Set(d, c.eps_px_per_m), hn::Set(d, c.eps_px));

  const Position p = position(l, s);
  const VF rate_u = hn::NegMulAdd(p.u, l.w1, l.u1), rate_v = hn::NegMulAdd(p.v, l.w1, l.v1);
  const Way<kBothWays> along_u(rate_u), along_v(rate_v);
  // On a border of this camera's: the pixel behind it, half a pixel on.
  const MF from_u = hn::RebindMask(d, hn::Eq(crossed, hn::Set(di, 2 * camera))),
           from_v = hn::RebindMask(d, hn::Eq(crossed, hn::Set(di, 2 * camera + 1)));
  const VF biased_u = hn::Add(p.u, hn::IfThenElseZero(from_u, along_u.choose(hn::Neg(half), half))),
           biased_v = hn::Add(p.v, hn::IfThenElseZero(from_v, along_v.choose(hn::Neg(half), half)));
  VF fu = hn::Round(biased_u), fv = hn::Round(biased_v);

  // Near a border behind which the verdict may differ, ahead or behind?
  const VF error_scale = hn::Mul(s_error, p.inverse_w);
  const VF off_u = hn::MulAdd(along_u.forward(rate_u), error_scale, hn::Abs(hn::Sub(biased_u, fu))),
           off_v = hn::MulAdd(along_v.forward(rate_v), error_scale, hn::Abs(hn::Sub(biased_v, fv)));
  const MF uncertain = hn::And(asked, hn::Gt(hn::Max(off_u, off_v), hn::Sub(half, eps)));

  // To the end of the box; a verdict `inside` is held only until a little before.
  const VF signed_extent = extent_at(c, fu, fv, along_u, along_v), steps = hn::Abs(signed_extent);
  const MF inside = hn::Lt(signed_extent, zero);
  const VF extent = hn::Sub(steps, hn::IfThenElse(inside, hn::Set(d, 0.5f + kBoxMargin_px), half));
  const VF way_u = along_u.left(hn::Sub(p.u, fu), extent),
           way_v = along_v.left(hn::Sub(p.v, fv), extent);
  const VF over_u = divisor(way_u, along_u.forward(rate_u), l.w1),
           over_v = divisor(way_v, along_v.forward(rate_v), l.w1);
  const MF by_u = hn::Le(hn::Mul(way_u, over_v), hn::Mul(way_v, over_u));
  const VF way = hn::IfThenElse(by_u, way_u, way_v),
           per_over = reciprocal(hn::IfThenElse(by_u, over_u, over_v)),
           per_px = hn::Mul(p.w, per_over);
  const VF next = hn::MulAdd(way, per_px, s);
  // How far that may be from the crossing: what the position's error, where it is and where it
  // goes, and the way's take. A pixel takes W_next / W times as long there as here.
  const VF eps_next =
      hn::MulAdd(hn::Min(next, hn::Set(d, span)), hn::Set(d, c.eps_px_per_m), hn::Set(d, c.eps_px));
  const VF slower = hn::Min(
      hn::Max(
          hn::Mul(hn::IfThenElse(by_u, along_u.forward(rate_u), along_v.forward(rate_v)), per_over),
          hn::Set(d, 1.0f)),
      hn::Set(d, kMaxDepthRatio));
  const VF error = hn::Mul(hn::MulAdd(way, hn::Set(d, kPathError), hn::Add(eps, eps_next)),
                           hn::Mul(per_px, slower));

  const MF agreed = hn::AndNot(uncertain, hn::And(asked, inside)),
           outside = hn::AndNot(uncertain, hn::AndNot(inside, asked));
  hn::Store(hn::IfThenElse(agreed, hn::Max(next, hn::Add(s, s_error)), hn::Load(d, hold_at)), d,
            hold_at);
  hn::Store(hn::IfThenElse(outside, next, s), d, s_at);
  hn::Store(hn::IfThenElse(outside, error, s_error), d, s_error_at);
  const VF pixel = hn::IfThenElse(by_u, fu, fv);
  VF border = hn::Add(pixel, steps);
  if constexpr (kBothWays) {
    const VF back = hn::Sub(hn::Add(pixel, hn::Set(d, 1.0f)), steps);
    border = hn::IfThenElse(by_u, along_u.choose(back, border), along_v.choose(back, border));
  }
  hn::Store(hn::IfThenElse(outside, border, hn::Load(d, border_at)), d, border_at);
  const auto code = hn::IfThenElse(hn::RebindMask(di, by_u), hn::Set(di, 2 * camera),
                                   hn::Set(di, 2 * camera + 1));
  hn::Store(hn::IfThenElse(hn::RebindMask(di, outside), code, crossed), di, crossed_at);

  // Beyond the range, or already past all that is in store.
  const MF past = hn::Lt(hn::Min(way_u, way_v), hn::Set(d, kPastExtent_px));
  const MF missed = hn::And(outside, hn::Or(past, hn::Gt(hn::Sub(next, error), hn::Set(d, span))));
  return {std::uint32_t(bits_of(d, hn::AndNot(missed, outside))), std::uint32_t(bits_of(d, missed)),
          std::uint32_t(bits_of(d, uncertain))};
}

struct PacketBits {  // of the rays of one vector each
  std::uint32_t active[kRays / 4], moved[kRays / 4], uncertain[kRays / 4], hit[kRays / 4];
};

struct Offsets {  // of a small tile's rays from its middle
  alignas(64) float i[kTileRays], j[kTileRays];
};

// Asks a camera about the packets of the list, again those that it moves on; the list is used up.
template <bool kBothWays>
HWY_INLINE void ask(const BlockCamera& camera, int number, float span, const Offsets& offsets,
                    std::uint16_t* list, int count, std::uint32_t* asked, PacketBits& bits,
                    SimdScratch& scratch) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  for (int repeat = 0; repeat < kRayRepeats && count; ++repeat) {
    int still = 0;
    for (int n = 0; n < count; ++n) {
      const int p = list[n], first = p * lanes, tile = first / kTileRays, k = first % kTileRays;
      const VF i = hn::Add(hn::Load(d, offsets.i + k),
                           hn::Set(d, scratch.small_tiles.center_i[tile])),
               j = hn::Add(hn::Load(d, offsets.j + k),
                           hn::Set(d, scratch.small_tiles.center_j[tile]));
      const StepBits step = step_rays<kBothWays>(
          camera, number, i, j, asked[p], span, scratch.s + first, scratch.s_error + first,
          scratch.crossed + first, scratch.border + first, scratch.hold[number] + first);
      bits.moved[p] |= step.outside;
      bits.uncertain[p] |= step.uncertain;
      bits.active[p] &= ~(step.missed | step.uncertain);
      asked[p] = step.outside;
      list[still] = std::uint16_t(p);
      still += step.outside != 0;
    }
    count = still;
  }
}

// Rays by vectors ("packets"), in the order of `packets`, which holds `count` of those with active
// rays.
HWY_INLINE void trace_rays(std::span<const BlockCamera> cameras,
                           std::span<const std::uint8_t> order, float span, std::uint16_t* packets,
                           int count, PacketBits& bits, SimdScratch& scratch) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  Offsets offsets;
  for (int k = 0; k < kTileRays; ++k)
    offsets.i[k] = float(k % kSmallTile_px) - 0.5f * (kSmallTile_px - 1),
    offsets.j[k] = float(k / kSmallTile_px) - 0.5f * (kSmallTile_px - 1);
  std::uint16_t list[kRays / 4];
  std::uint32_t asked[kRays / 4];
  for (int round = 0; round < kRayRounds && count; ++round) {
    for (int n = 0; n < count; ++n) bits.moved[packets[n]] = 0;
    for (const std::uint8_t c : order) {
      int asking = 0;
      for (int n = 0; n < count; ++n) {
        const int p = packets[n], first = p * lanes;
        const VF until =
            hn::Add(hn::Load(d, scratch.s + first), hn::Load(d, scratch.s_error + first));
        asked[p] = std::uint32_t(bits_of(d, hn::Lt(hn::Load(d, scratch.hold[c] + first), until))) &
                   bits.active[p];
        list[asking] = std::uint16_t(p);
        asking += asked[p] != 0;
      }
      if (cameras[c].both_ways)
        ask<true>(cameras[c], int(c), span, offsets, list, asking, asked, bits, scratch);
      else
        ask<false>(cameras[c], int(c), span, offsets, list, asking, asked, bits, scratch);
    }
    int left = 0;
    for (int n = 0; n < count; ++n) {
      const int p = packets[n];
      bits.hit[p] |= bits.active[p] & ~bits.moved[p];
      bits.active[p] &= bits.moved[p];
      packets[left] = std::uint16_t(p);
      left += bits.active[p] != 0;
    }
    count = left;
  }
  for (int n = 0; n < count; ++n) bits.uncertain[packets[n]] |= bits.active[packets[n]];
}

// --- finish
// ----------------------------------------------------------------------------------------------------

// The depth of a small tile's hits from the borders that they crossed last, in double:
// `border_crossing` in lanes. (u, v): the tile's first ray in the view; depth_m: its place. Returns
// those that need settling after all.
HWY_INLINE std::uint32_t finish(const Block& block, int tile, int u0, int v0, std::uint32_t hit,
                                const SimdScratch& scratch, float* depth_m, std::ptrdiff_t pitch) {
  const hn::CappedTag<double, 8> dd;
  const hn::Rebind<float, decltype(dd)> df;
  const DI di;
  const int lanes = int(hn::Lanes(dd)), packet = int(hn::Lanes(di));
  const std::int32_t* crossed = scratch.crossed + tile * kTileRays;
  const float* borders = scratch.border + tile * kTileRays;
  alignas(64) double depth[kTileRays], column[kTileRays], row[kTileRays];
  for (int k = 0; k < kTileRays; ++k)
    column[k] = u0 + k % kSmallTile_px, row[k] = v0 + k / kSmallTile_px;
  for (std::uint32_t todo = hit;
       todo;) {  // all hits that crossed the same camera's border on the same axis
    const int code = crossed[std::countr_zero(todo)];
    std::uint32_t same = 0;
    for (int first = 0; first < kTileRays; first += packet)
      same |=
          std::uint32_t(bits_of(
              DF(), hn::RebindMask(DF(), hn::Eq(hn::Load(di, crossed + first), hn::Set(di, code)))))
          << first;
    same &= todo;
    todo &= ~same;
    if (code < 0) {  // inside all from the start: in the hull at the near plane, or not yet settled
      const double at = block.begins_at_near ? block.near : -1;
      for (std::uint32_t m = same; m; m &= m - 1) depth[std::countr_zero(m)] = at;
      continue;
    }
    const BlockCamera& c = block.cameras[std::size_t(code / 2)];
    const Eigen::Matrix3d& infinity = c.exact->at_infinity;
    const int axis = code % 2;
    const auto a0 = hn::Set(dd, infinity(axis, 0)), a1 = hn::Set(dd, infinity(axis, 1)),
               a2 = hn::Set(dd, infinity(axis, 2));
    const auto w0 = hn::Set(dd, infinity(2, 0)), w1 = hn::Set(dd, infinity(2, 1)),
               w2 = hn::Set(dd, infinity(2, 2));
    const auto offset = hn::Set(dd, c.exact->at_eye[axis]),
               w_offset = hn::Set(dd, c.exact->at_eye[2]);
    const auto origin = hn::Set(dd, double(axis ? c.origin_v_px : c.origin_u_px)),
               sign = hn::Set(dd, double(axis ? c.sign_v : c.sign_u));
    for (int first = 0; first < kTileRays; first += lanes) {
      const std::uint32_t here = same >> first & ((1u << lanes) - 1);
      if (!here) continue;
      const auto u = hn::Load(dd, column + first), v = hn::Load(dd, row + first);
      const auto slope = hn::Add(hn::Mul(a0, u), hn::Add(hn::Mul(a1, v), a2)),
                 w_slope = hn::Add(hn::Mul(w0, u), hn::Add(hn::Mul(w1, v), w2));
      const auto border =
          hn::Add(origin, hn::Mul(sign, hn::PromoteTo(dd, hn::Load(df, borders + first))));
      const auto t = hn::Div(hn::Sub(hn::Mul(border, w_offset), offset),
                             hn::Sub(slope, hn::Mul(border, w_slope)));
      std::uint8_t mask[8] = {std::uint8_t(here)};
      hn::BlendedStore(t, hn::LoadMaskBits(dd, mask), dd, depth + first);
    }
  }
  std::uint32_t uncertain = 0;
  for (std::uint32_t m = hit; m; m &= m - 1) {
    const int k = std::countr_zero(m);
    if (!(depth[k] >= block.near))
      uncertain |= m & -m;
    else
      depth_m[(k / kSmallTile_px) * pitch + k % kSmallTile_px] =
          depth[k] < block.far ? float(depth[k]) : kNoHull;
  }
  return uncertain;
}

// --- block
// -----------------------------------------------------------------------------------------------------

float span_of(const Block& block) { return float(block.end - block.begin) * (1 + kSpanSlack); }

void march(const Block& block, SimdScratch& scratch) {
  TileSet& tiles = scratch.tiles;
  tiles.count = 0;
  for (int j = 0; j < block.rays.height_px(); j += kTile_px)
    for (int i = 0; i < block.rays.width_px(); i += kTile_px) {
      tiles.center_i[tiles.count] = float(i) + 0.5f * (kTile_px - 1),
      tiles.center_j[tiles.count] = float(j) + 0.5f * (kTile_px - 1), tiles.s[tiles.count] = 0;
      for (std::size_t c = 0; c < block.cameras.size(); ++c)
        tiles.hold[c][tiles.count] = kNoVerdictEnd;
      ++tiles.count;
    }
  march_tiles(block.cameras, kTile_px, span_of(block), tiles);
}

// A small tile's rays that lie in the block.
std::uint32_t rays_in_tile(int i, int j, const PixelRect& rays) {
  const int columns = rays.width_px() - i, rows = rays.height_px() - j;
  if (columns >= kSmallTile_px && rows >= kSmallTile_px) return (1u << kTileRays) - 1;
  std::uint32_t bits = 0;
  for (int k = 0; k < kTileRays; ++k)
    bits |= std::uint32_t(k % kSmallTile_px < columns && k / kSmallTile_px < rows) << k;
  return bits;
}

int trace(const Block& block, SimdScratch& scratch, float* depth_m, std::ptrdiff_t pitch,
          std::uint16_t* uncertain) {
  const DF d;
  const DI di;
  const int lanes = int(hn::Lanes(d)), packets_a_tile = kTileRays / lanes;
  const std::size_t cameras = block.cameras.size();
  TileSet& tiles = scratch.small_tiles;
  split_tiles(scratch.tiles, block.rays, cameras, tiles);
  march_tiles(block.cameras, kSmallTile_px, span_of(block), tiles);

  const auto first_ray = [](float middle) { return int(middle - 0.5f * (kSmallTile_px - 1)); };
  PacketBits bits;
  std::uint16_t packets[kRays / 4];
  int count = 0;
  for (int tile = 0; tile < tiles.count; ++tile) {
    const std::uint32_t rays =
        rays_in_tile(first_ray(tiles.center_i[tile]), first_ray(tiles.center_j[tile]), block.rays);
    for (int n = 0; n < packets_a_tile; ++n) {
      const int p = tile * packets_a_tile + n, first = p * lanes;
      hn::Store(hn::Set(d, tiles.s[tile]), d, scratch.s + first);
      hn::Store(hn::Zero(d), d, scratch.s_error + first);
      hn::Store(hn::Zero(d), d, scratch.border + first);
      hn::Store(hn::Set(di, kNoBorder), di, scratch.crossed + first);
      for (std::size_t c = 0; c < cameras; ++c)
        hn::Store(hn::Set(d, tiles.hold[c][tile]), d, scratch.hold[c] + first);
      bits.active[p] = rays >> (n * lanes) & ((1u << lanes) - 1);
      bits.uncertain[p] = bits.hit[p] = 0;
      packets[count] = std::uint16_t(p);
      count += bits.active[p] != 0;
    }
  }
  // First those that stopped most tiles before their object: they know most of where the rays enter
  // the hull.
  std::uint8_t order[kMaxSimdCameras];
  std::iota(order, order + cameras, std::uint8_t(0));
  std::stable_sort(order, order + cameras,
                   [&](int a, int b) { return tiles.stopped[a] > tiles.stopped[b]; });
  trace_rays(block.cameras, {order, cameras}, span_of(block), packets, count, bits, scratch);
  int open = 0;
  for (int tile = 0; tile < tiles.count; ++tile) {
    std::uint32_t hit = 0, unsure = 0;
    for (int n = 0; n < packets_a_tile; ++n) {
      hit |= bits.hit[tile * packets_a_tile + n] << (n * lanes);
      unsure |= bits.uncertain[tile * packets_a_tile + n] << (n * lanes);
    }
    const int i = first_ray(tiles.center_i[tile]), j = first_ray(tiles.center_j[tile]);
    if (hit)
      unsure |= finish(block, tile, block.rays.u0_px + i, block.rays.v0_px + j, hit, scratch,
                       depth_m + j * pitch + i, pitch);
    for (; unsure; unsure &= unsure - 1) {
      const int k = std::countr_zero(unsure);
      uncertain[open++] =
          std::uint16_t((j + k / kSmallTile_px) * kBlock_px + i + k % kSmallTile_px);
    }
  }
  return open;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::hull {
namespace {
HWY_EXPORT(march);
HWY_EXPORT(trace);

}  // namespace

int trace_block(Block& block, std::span<const MapFromView> maps,
                std::span<const SkipMap* const> skip_maps, SimdScratch& scratch, float* depth_m,
                std::ptrdiff_t pitch, std::uint16_t* uncertain) {
  const int width = block.rays.width_px(), height = block.rays.height_px();
  for (int v = 0; v < height; ++v) std::fill_n(depth_m + v * pitch, width, kNoHull);
  const auto all_by_double = [&] {
    int count = 0;
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) uncertain[count++] = std::uint16_t(v * kBlock_px + u);
    return count;
  };
  if (!prepare(block, maps, skip_maps)) return all_by_double();
  HWY_DYNAMIC_DISPATCH(march)(block, scratch);
  TileSet& tiles = scratch.tiles;
  if (tiles.count == 0) return 0;
  // Anew from where the first tile goes on: numbers are smaller there, and positions surer.
  const float first = *std::min_element(tiles.s, tiles.s + tiles.count);
  if (first > 0) {
    block.begin += double(first);
    block.begins_at_near = false;
    if (!prepare(block, maps, skip_maps)) return all_by_double();
    for (int t = 0; t < tiles.count; ++t) {
      tiles.s[t] -= first;
      for (std::size_t c = 0; c < maps.size(); ++c) tiles.hold[c][t] -= first;
    }
  }
  return HWY_DYNAMIC_DISPATCH(trace)(block, scratch, depth_m, pitch, uncertain);
}

}  // namespace fivepipe::hull
#endif
