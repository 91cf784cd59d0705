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

#include "common/hull/cpu/ray_simd.h"
#include "common/hull/cpu/ray_walk.h"
#include "common/hull/cpu/step_simd-inl.h"
#include "common/hull/cpu/tile_simd-inl.h"
#include "common/hull/hull.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

// Relative rounding by which the block's range may be too short: a few operations of float.
constexpr float kSpanSlack = 1e-5f;

// Computes the depths of a small tile's hits in double from the borders that they crossed last
// (SIMD form of border_crossing()). (u0, v0) is the tile's first ray in the view, depth_m its
// depth. Returns the hits that must be traced in double.
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
  // Each pass handles all hits that crossed a border of the same camera on the same axis.
  for (std::uint32_t todo = hit; todo;) {
    const int code = crossed[std::countr_zero(todo)];
    std::uint32_t same = 0;
    for (int first = 0; first < kTileRays; first += packet)
      same |=
          std::uint32_t(bits_of(
              DF(), hn::RebindMask(DF(), hn::Eq(hn::Load(di, crossed + first), hn::Set(di, code)))))
          << first;
    same &= todo;
    todo &= ~same;
    if (code < 0) {  // on all objects from the start: at the near plane, or traced in double
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

// Returns the bits of the small tile's rays that are in the block.
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
  const int lanes = int(hn::Lanes(d)), packets_per_tile = kTileRays / lanes;
  const std::size_t cameras = block.cameras.size();
  TileSet& tiles = scratch.small_tiles;
  split_tiles(scratch.tiles, block.rays, cameras, tiles);
  march_tiles(block.cameras, kSmallTile_px, span_of(block), tiles);

  const auto first_ray = [](float center) { return int(center - 0.5f * (kSmallTile_px - 1)); };
  PacketBits bits;
  std::uint16_t packets[kRays / 4];
  int count = 0;
  for (int tile = 0; tile < tiles.count; ++tile) {
    const std::uint32_t rays =
        rays_in_tile(first_ray(tiles.center_i[tile]), first_ray(tiles.center_j[tile]), block.rays);
    for (int n = 0; n < packets_per_tile; ++n) {
      const int p = tile * packets_per_tile + n, first = p * lanes;
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
  // Test the cameras that stopped the most tiles first, because their objects limit most of the
  // hull in this block.
  std::uint8_t order[kMaxSimdCameras];
  std::iota(order, order + cameras, std::uint8_t(0));
  std::stable_sort(order, order + cameras,
                   [&](int a, int b) { return tiles.stopped[a] > tiles.stopped[b]; });
  trace_rays(block.cameras, {order, cameras}, span_of(block), packets, count, bits, scratch);
  int open = 0;
  for (int tile = 0; tile < tiles.count; ++tile) {
    std::uint32_t hit = 0, uncertain_bits = 0;
    for (int n = 0; n < packets_per_tile; ++n) {
      hit |= bits.hit[tile * packets_per_tile + n] << (n * lanes);
      uncertain_bits |= bits.uncertain[tile * packets_per_tile + n] << (n * lanes);
    }
    const int i = first_ray(tiles.center_i[tile]), j = first_ray(tiles.center_j[tile]);
    if (hit)
      uncertain_bits |= finish(block, tile, block.rays.u0_px + i, block.rays.v0_px + j, hit,
                               scratch, depth_m + j * pitch + i, pitch);
    for (; uncertain_bits; uncertain_bits &= uncertain_bits - 1) {
      const int k = std::countr_zero(uncertain_bits);
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
  // Restart at the position of the first remaining tile, because smaller numbers make positions
  // more precise.
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
