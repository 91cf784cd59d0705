// Moves the rays of a block on, a vector of rays at a time, until all cameras agree or a ray misses
// the hull. Each includer compiles this file once per instruction set.
#if defined(FIVEPIPE_STEP_SIMD_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FIVEPIPE_STEP_SIMD_INL_H
#undef FIVEPIPE_STEP_SIMD_INL_H
#else
#define FIVEPIPE_STEP_SIMD_INL_H
#endif

#include <hwy/highway.h>

#include "common/hull/cpu/block_simd-inl.h"
#include "common/hull/cpu/ray_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

constexpr int kTileRays = kSmallTile_px * kSmallTile_px;
// Maximum rounds of a ray through all cameras, and consecutive steps with one camera.
constexpr int kRayRounds = 24, kRayRepeats = 8;
// An image further past the end of a box than this is past all stored pixels [px]. Otherwise it is
// in the box, except for its error.
constexpr float kPastExtent_px = -0.5f;
// Relative rounding of a distance in an image: a few operations of float.
constexpr float kPathError = 1e-6f;

// SimdScratch::crossed holds 2 * camera + axis of the border that a ray crossed last, or this.
constexpr std::int32_t kNoBorder = -1;

// One bit per ray: the camera moved it on, it missed the hull, or float cannot decide it.
struct StepBits {
  std::uint32_t outside, missed, uncertain;
};

// The state of a vector of rays in SimdScratch; `hold` is that of one camera.
struct RayState {
  float *s, *s_error;
  std::int32_t* crossed;
  float *border, *hold;
};

// Images of a vector of rays in one map at s.
template <bool kBothWays>
struct RayImages {
  Lines l;
  Position p;
  VF rate_u, rate_v;
  Direction<kBothWays> along_u, along_v;
};
template <bool kBothWays>
HWY_INLINE RayImages<kBothWays> images_at(const Lines& l, VF s) {
  const Position p = position(l, s);
  const VF rate_u = hn::NegMulAdd(p.u, l.w1, l.u1), rate_v = hn::NegMulAdd(p.v, l.w1, l.v1);
  return {l, p, rate_u, rate_v, Direction<kBothWays>(rate_u), Direction<kBothWays>(rate_v)};
}

// Finds the pixels (fu, fv) of the images. Returns the images that are so near to a border, ahead
// or behind, that rounding decides on which side they are.
template <bool kBothWays>
HWY_INLINE MF find_pixels(const RayImages<kBothWays>& image, int camera, hn::Vec<DI> crossed,
                          VF s_error, VF eps, VF& fu, VF& fv) {
  const DF d;
  const DI di;
  const VF half = hn::Set(d, 0.5f);
  // If the ray is on a border of this camera's map, its pixel is the one beyond that border. Adding
  // half a pixel in the direction of motion gives its centre.
  const MF from_u = hn::RebindMask(d, hn::Eq(crossed, hn::Set(di, 2 * camera))),
           from_v = hn::RebindMask(d, hn::Eq(crossed, hn::Set(di, 2 * camera + 1)));
  const VF biased_u = hn::Add(
               image.p.u, hn::IfThenElseZero(from_u, image.along_u.choose(hn::Neg(half), half))),
           biased_v = hn::Add(
               image.p.v, hn::IfThenElseZero(from_v, image.along_v.choose(hn::Neg(half), half)));
  fu = hn::Round(biased_u), fv = hn::Round(biased_v);
  const VF error_scale = hn::Mul(s_error, image.p.inverse_w);
  const VF off_u = hn::MulAdd(image.along_u.forward(image.rate_u), error_scale,
                              hn::Abs(hn::Sub(biased_u, fu))),
           off_v = hn::MulAdd(image.along_v.forward(image.rate_v), error_scale,
                              hn::Abs(hn::Sub(biased_v, fv)));
  return hn::Gt(hn::Max(off_u, off_v), hn::Sub(half, eps));
}

// Exit of a vector of rays from the boxes ahead of their pixels.
struct BoxExit {
  VF steps;                 // extent of the box [px]
  MF inside;                // the box has object pixels
  MF by_u;                  // the images leave it along u
  VF min_gap, next, error;  // nearest end [px]; ray parameter of the exit and its error [m]
};
template <bool kBothWays>
HWY_INLINE BoxExit box_exit(const BlockCamera& c, const RayImages<kBothWays>& image, VF& fu, VF& fv,
                            VF s, VF eps, float span) {
  const DF d;
  const VF zero = hn::Zero(d), half = hn::Set(d, 0.5f);
  // The span of a verdict `inside` ends kBoxMargin_px before the box does.
  const VF signed_extent = extent_at(c, fu, fv, image.along_u, image.along_v),
           steps = hn::Abs(signed_extent);
  const MF inside = hn::Lt(signed_extent, zero);
  const VF extent = hn::Sub(steps, hn::IfThenElse(inside, hn::Set(d, 0.5f + kBoxMargin_px), half));
  const VF gap_u = image.along_u.remaining(hn::Sub(image.p.u, fu), extent),
           gap_v = image.along_v.remaining(hn::Sub(image.p.v, fv), extent);
  const VF ahead_u = image.along_u.forward(image.rate_u),
           ahead_v = image.along_v.forward(image.rate_v);
  const VF over_u = divisor(gap_u, ahead_u, image.l.w1),
           over_v = divisor(gap_v, ahead_v, image.l.w1);
  const MF by_u = hn::Le(hn::Mul(gap_u, over_v), hn::Mul(gap_v, over_u));
  const VF gap = hn::IfThenElse(by_u, gap_u, gap_v),
           per_over = reciprocal(hn::IfThenElse(by_u, over_u, over_v)),
           per_px = hn::Mul(image.p.w, per_over);
  const VF next = hn::MulAdd(gap, per_px, s);
  // Bound of the distance from `next` to the crossing: from the errors of the positions at s and at
  // `next`, and of `gap`. At `next`, a pixel takes W_next / W times the ray parameter that it takes
  // at s.
  const VF eps_next =
      hn::MulAdd(hn::Min(next, hn::Set(d, span)), hn::Set(d, c.eps_px_per_m), hn::Set(d, c.eps_px));
  const VF slower =
      hn::Min(hn::Max(hn::Mul(hn::IfThenElse(by_u, ahead_u, ahead_v), per_over), hn::Set(d, 1.0f)),
              hn::Set(d, kMaxDepthRatio));
  const VF error = hn::Mul(hn::MulAdd(gap, hn::Set(d, kPathError), hn::Add(eps, eps_next)),
                           hn::Mul(per_px, slower));
  return {steps, inside, by_u, hn::Min(gap_u, gap_v), next, error};
}

// Moves the rays of `outside` on to the border that they cross.
template <bool kBothWays>
HWY_INLINE void cross_border(const RayImages<kBothWays>& image, const BoxExit& exit, int camera,
                             VF fu, VF fv, MF outside, VF s, VF s_error, hn::Vec<DI> crossed,
                             const RayState& ray) {
  const DF d;
  const DI di;
  hn::Store(hn::IfThenElse(outside, exit.next, s), d, ray.s);
  hn::Store(hn::IfThenElse(outside, exit.error, s_error), d, ray.s_error);
  const VF pixel = hn::IfThenElse(exit.by_u, fu, fv);
  VF border = hn::Add(pixel, exit.steps);
  if constexpr (kBothWays) {
    const VF back = hn::Sub(hn::Add(pixel, hn::Set(d, 1.0f)), exit.steps);
    border = hn::IfThenElse(exit.by_u, image.along_u.choose(back, border),
                            image.along_v.choose(back, border));
  }
  hn::Store(hn::IfThenElse(outside, border, hn::Load(d, ray.border)), d, ray.border);
  const auto code = hn::IfThenElse(hn::RebindMask(di, exit.by_u), hn::Set(di, 2 * camera),
                                   hn::Set(di, 2 * camera + 1));
  hn::Store(hn::IfThenElse(hn::RebindMask(di, outside), code, crossed), di, ray.crossed);
}

// Tests the rays of tested_bits with one camera, which agrees or moves them on. (i, j) are the
// rays' positions in the block.
template <bool kBothWays>
HWY_INLINE StepBits step_rays(const BlockCamera& c, int camera, VF i, VF j,
                              std::uint32_t tested_bits, float span, const RayState& ray) {
  const DF d;
  const DI di;
  const VF s = hn::Load(d, ray.s), s_error = hn::Load(d, ray.s_error);
  const auto crossed = hn::Load(di, ray.crossed);
  const MF tested = mask_of(d, tested_bits);
  const VF eps = hn::MulAdd(s, hn::Set(d, c.eps_px_per_m), hn::Set(d, c.eps_px));
  const RayImages<kBothWays> image = images_at<kBothWays>(lines_at(c, i, j), s);
  VF fu, fv;
  const MF uncertain = hn::And(tested, find_pixels(image, camera, crossed, s_error, eps, fu, fv));
  const BoxExit exit = box_exit(c, image, fu, fv, s, eps, span);
  const MF agreed = hn::AndNot(uncertain, hn::And(tested, exit.inside)),
           outside = hn::AndNot(uncertain, hn::AndNot(exit.inside, tested));
  hn::Store(hn::IfThenElse(agreed, hn::Max(exit.next, hn::Add(s, s_error)), hn::Load(d, ray.hold)),
            d, ray.hold);
  cross_border(image, exit, camera, fu, fv, outside, s, s_error, crossed, ray);
  // The crossing is beyond the range, or the image is already past all stored pixels.
  const MF past = hn::Lt(exit.min_gap, hn::Set(d, kPastExtent_px));
  const MF missed =
      hn::And(outside, hn::Or(past, hn::Gt(hn::Sub(exit.next, exit.error), hn::Set(d, span))));
  return {std::uint32_t(bits_of(d, hn::AndNot(missed, outside))), std::uint32_t(bits_of(d, missed)),
          std::uint32_t(bits_of(d, uncertain))};
}

struct PacketBits {  // one bit per ray of a vector ("packet")
  std::uint32_t active[kRays / 4], moved[kRays / 4], uncertain[kRays / 4], hit[kRays / 4];
};

struct Offsets {  // of a small tile's rays from its center
  alignas(64) float i[kTileRays], j[kTileRays];
};

// Tests the packets of the list with a camera, and tests those that it moves on again, up to
// kRayRepeats times. Overwrites the list.
template <bool kBothWays>
HWY_INLINE void test_packets(const BlockCamera& camera, int number, float span,
                             const Offsets& offsets, std::uint16_t* list, int count,
                             std::uint32_t* tested, PacketBits& bits, SimdScratch& scratch) {
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
      const RayState ray{scratch.s + first, scratch.s_error + first, scratch.crossed + first,
                         scratch.border + first, scratch.hold[number] + first};
      const StepBits step = step_rays<kBothWays>(camera, number, i, j, tested[p], span, ray);
      bits.moved[p] |= step.outside;
      bits.uncertain[p] |= step.uncertain;
      bits.active[p] &= ~(step.missed | step.uncertain);
      tested[p] = step.outside;
      list[still] = std::uint16_t(p);
      still += step.outside != 0;
    }
    count = still;
  }
}

// Traces the `count` packets with active rays listed in `packets`. Overwrites `packets`.
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
  std::uint32_t tested[kRays / 4];
  for (int round = 0; round < kRayRounds && count; ++round) {
    for (int n = 0; n < count; ++n) bits.moved[packets[n]] = 0;
    for (const std::uint8_t c : order) {
      int testing = 0;
      for (int n = 0; n < count; ++n) {
        const int p = packets[n], first = p * lanes;
        const VF end =
            hn::Add(hn::Load(d, scratch.s + first), hn::Load(d, scratch.s_error + first));
        tested[p] = std::uint32_t(bits_of(d, hn::Lt(hn::Load(d, scratch.hold[c] + first), end))) &
                    bits.active[p];
        list[testing] = std::uint16_t(p);
        testing += tested[p] != 0;
      }
      if (cameras[c].both_ways)
        test_packets<true>(cameras[c], int(c), span, offsets, list, testing, tested, bits, scratch);
      else
        test_packets<false>(cameras[c], int(c), span, offsets, list, testing, tested, bits,
                            scratch);
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

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#endif
