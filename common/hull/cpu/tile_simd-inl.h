// Moves the tiles of a block on, a vector of tiles at a time, while none of their rays can meet the
// hull. Each includer compiles this file once per instruction set.
#if defined(FIVEPIPE_TILE_SIMD_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FIVEPIPE_TILE_SIMD_INL_H
#undef FIVEPIPE_TILE_SIMD_INL_H
#else
#define FIVEPIPE_TILE_SIMD_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/hull/cpu/block_simd-inl.h"
#include "common/hull/cpu/ray_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

// Maximum rounds of a tile through all cameras, and consecutive steps with one camera.
constexpr int kTileRounds = 4, kTileRepeats = 6;
// A tile whose step is smaller than this is traced ray by ray [px].
constexpr float kMinTileStep_px = 0.75f;
constexpr float kNoVerdictEnd = -1.0f;

// One step of a vector of tiles: the advance [m] and SkipMap::at() of the box [px].
struct TileStep {
  VF advance, extent;
  MF stuck;  // the rays are not in one box, or leave it within kMinTileStep_px
};

// Computes how far a tile can advance. The images of all its rays are in the box ahead of the
// hindmost corner's image as long as the images of its four corners are.
template <bool kBothWays>
HWY_INLINE TileStep step_tiles(const BlockCamera& c, float half, VF center_i, VF center_j, VF s) {
  const DF d;
  const VF zero = hn::Zero(d), margin = hn::Set(d, kBoxMargin_px);
  Position p[4];
  VF rate_u[4], rate_v[4], w1[4];
  VF min_u = hn::Set(d, kFar), max_u = hn::Neg(min_u), min_v = min_u, max_v = max_u;
  for (int corner = 0; corner < 4; ++corner) {
    const Lines l = lines_at(c, hn::Add(center_i, hn::Set(d, corner & 1 ? half : -half)),
                             hn::Add(center_j, hn::Set(d, corner & 2 ? half : -half)));
    p[corner] = position(l, s);
    rate_u[corner] = hn::NegMulAdd(p[corner].u, l.w1, l.u1),
    rate_v[corner] = hn::NegMulAdd(p[corner].v, l.w1, l.v1), w1[corner] = l.w1;
    min_u = hn::Min(min_u, p[corner].u), min_v = hn::Min(min_v, p[corner].v);
    if (kBothWays) max_u = hn::Max(max_u, p[corner].u), max_v = hn::Max(max_v, p[corner].v);
  }
  const Direction<kBothWays> along_u(rate_u[0]), along_v(rate_v[0]);
  VF fu = hn::Round(along_u.choose(hn::Add(max_u, margin), hn::Sub(min_u, margin))),
     fv = hn::Round(along_v.choose(hn::Add(max_v, margin), hn::Sub(min_v, margin)));
  const VF extent = extent_at(c, fu, fv, along_u, along_v),
           room = hn::Sub(hn::Abs(extent), hn::Set(d, 0.5f + kBoxMargin_px));
  VF advance = hn::Set(d, kFar), min_gap = hn::Set(d, kFar);
  for (int corner = 0; corner < 4; ++corner) {
    const VF gap_u = along_u.remaining(hn::Sub(p[corner].u, fu), room),
             gap_v = along_v.remaining(hn::Sub(p[corner].v, fv), room);
    const VF ahead_u = along_u.forward(rate_u[corner]), ahead_v = along_v.forward(rate_v[corner]);
    VF gap = hn::Min(gap_u, gap_v);
    if (kBothWays)
      gap = hn::IfThenElse(hn::Lt(hn::Min(ahead_u, ahead_v), zero), zero,
                           gap);  // diverging corners soon leave the box
    min_gap = hn::Min(min_gap, gap);
    const VF take_u = hn::Mul(gap_u, reciprocal(divisor(gap_u, ahead_u, w1[corner]))),
             take_v = hn::Mul(gap_v, reciprocal(divisor(gap_v, ahead_v, w1[corner])));
    advance = hn::Min(advance, hn::Mul(p[corner].w, hn::Min(take_u, take_v)));
  }
  return {advance, extent, hn::Lt(min_gap, hn::Set(d, kMinTileStep_px))};
}

// Moves each tile on as far as the cameras allow. Keeps the tiles that may meet the hull, in the
// same order.
HWY_INLINE void march_tiles(std::span<const BlockCamera> cameras, int size_px, float span,
                            TileSet& tiles) {
  std::fill_n(tiles.stopped, cameras.size(), 0);
  const DF d;
  const int lanes = int(hn::Lanes(d));
  const float half = 0.5f * float(size_px - 1);
  std::uint64_t remaining = 0;
  for (int first = 0; first < tiles.count; first += lanes) {
    const VF i = hn::Load(d, tiles.center_i + first), j = hn::Load(d, tiles.center_j + first);
    VF s = hn::Load(d, tiles.s + first);
    MF live = hn::FirstN(d, std::size_t(std::min(lanes, tiles.count - first)));
    for (std::size_t c = 0; c < cameras.size(); ++c)
      hn::Store(hn::Set(d, kNoVerdictEnd), d, tiles.tested_at[c] + first);
    bool moved = true;
    for (int round = 0; round < kTileRounds && moved; ++round) {
      moved = false;
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        VF hold = hn::Load(d, tiles.hold[c] + first);
        MF tested =
            hn::And(live, hn::Lt(hn::Max(hold, hn::Load(d, tiles.tested_at[c] + first)), s));
        if (hn::AllFalse(d, tested)) continue;
        for (int repeat = 0; repeat < kTileRepeats && !hn::AllFalse(d, tested); ++repeat) {
          const TileStep step = cameras[c].both_ways ? step_tiles<true>(cameras[c], half, i, j, s)
                                                     : step_tiles<false>(cameras[c], half, i, j, s);
          tiles.stopped[c] += std::popcount(
              bits_of(d, hn::And(hn::And(tested, step.stuck), hn::Gt(step.extent, hn::Zero(d)))));
          const MF certain = hn::AndNot(step.stuck, tested),
                   inside = hn::And(certain, hn::Lt(step.extent, hn::Zero(d)));
          hold = hn::IfThenElse(inside, hn::Add(s, step.advance), hold);
          tested = hn::AndNot(inside, certain);
          s = hn::IfThenElse(tested, hn::Add(s, step.advance), s);
          moved |= !hn::AllFalse(d, tested);
          live = hn::AndNot(hn::And(tested, hn::Gt(s, hn::Set(d, span))), live);
          tested = hn::And(tested, live);
        }
        hn::Store(hold, d, tiles.hold[c] + first);
        hn::Store(s, d, tiles.tested_at[c] + first);
        if (hn::AllFalse(d, live)) break;
      }
    }
    hn::Store(s, d, tiles.s + first);
    remaining |= bits_of(d, live) << first;
  }
  int count = 0;
  for (; remaining; remaining &= remaining - 1, ++count) {
    const int t = std::countr_zero(remaining);
    tiles.center_i[count] = tiles.center_i[t], tiles.center_j[count] = tiles.center_j[t],
    tiles.s[count] = tiles.s[t];
    for (std::size_t c = 0; c < cameras.size(); ++c) tiles.hold[c][count] = tiles.hold[c][t];
  }
  tiles.count = count;
}

// Divides each tile into four small ones and keeps those that have rays in the block.
HWY_INLINE void split_tiles(const TileSet& tiles, const PixelRect& rays, std::size_t cameras,
                            TileSet& small) {
  small.count = 0;
  for (int t = 0; t < tiles.count; ++t)
    for (int part = 0; part < 4; ++part) {
      const float i = tiles.center_i[t] + float(part & 1 ? 1 : -1) * 0.5f * kSmallTile_px,
                  j = tiles.center_j[t] + float(part & 2 ? 1 : -1) * 0.5f * kSmallTile_px;
      if (!(i - 0.5f * kSmallTile_px < float(rays.width_px() - 1) &&
            j - 0.5f * kSmallTile_px < float(rays.height_px() - 1)))
        continue;
      small.center_i[small.count] = i, small.center_j[small.count] = j,
      small.s[small.count] = tiles.s[t];
      for (std::size_t c = 0; c < cameras; ++c) small.hold[c][small.count] = tiles.hold[c][t];
      ++small.count;
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#endif
