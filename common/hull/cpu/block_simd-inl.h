// Images of a vector of a block's rays in one map: position, direction and the uniform box ahead.
// Each includer compiles this file once per instruction set.
#if defined(FIVEPIPE_BLOCK_SIMD_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FIVEPIPE_BLOCK_SIMD_INL_H
#undef FIVEPIPE_BLOCK_SIMD_INL_H
#else
#define FIVEPIPE_BLOCK_SIMD_INL_H
#endif

#include <hwy/highway.h>

#include <cstring>

#include "common/hull/cpu/ray_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

// Lower bound of a divisor, so that the quotient is beyond every range, but finite.
constexpr float kTiny = 1e-20f;
// Larger than any ray parameter [m] or distance in an image [px].
constexpr float kFar = 1e30f;

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, DF>;
using VF = hn::Vec<DF>;
using MF = hn::Mask<DF>;

#if HWY_TARGET <= HWY_AVX3  // these targets store masks as bits
HWY_INLINE std::uint64_t bits_of(DF, MF mask) { return mask.raw; }
HWY_INLINE MF mask_of(DF, std::uint64_t bits) { return MF{decltype(MF::raw)(bits)}; }
#else
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
#endif

// Relative error at most 2^-22: each Newton step doubles the bits of the estimate, which has at
// least 11 on x86 and 8 on Arm.
HWY_INLINE VF reciprocal(VF x) {
  const DF d;
  VF estimate = hn::ApproximateReciprocal(x);
  for (int step = 0; step < (HWY_ARCH_X86 ? 1 : 2); ++step)
    estimate = hn::Mul(estimate, hn::NegMulAdd(x, estimate, hn::Set(d, 2.0f)));
  return estimate;
}

struct Lines {  // (U, V, W) of a vector of rays in one map: offset (0) and slope (1)
  VF u0, u1, v0, v1, w0, w1;
};
HWY_INLINE Lines lines_at(const BlockCamera& c, VF i, VF j) {
  const DF d;
  const auto linear = [&](float at, float by_i, float by_j) {
    return hn::MulAdd(j, hn::Set(d, by_j), hn::MulAdd(i, hn::Set(d, by_i), hn::Set(d, at)));
  };
  return {
      linear(c.at_begin[0], c.du_begin[0], c.dv_begin[0]), linear(c.slope[0], c.du[0], c.dv[0]),
      linear(c.at_begin[1], c.du_begin[1], c.dv_begin[1]), linear(c.slope[1], c.du[1], c.dv[1]),
      linear(c.at_begin[2], c.du_begin[2], c.dv_begin[2]), linear(c.slope[2], c.du[2], c.dv[2])};
}

// Positions of a vector of images [px], and their depth W in the map's camera [m].
struct Position {
  VF w, inverse_w, u, v;
};
HWY_INLINE Position position(const Lines& l, VF s) {
  const VF w = hn::MulAdd(s, l.w1, l.w0), inverse_w = reciprocal(w);
  return {w, inverse_w, hn::Mul(hn::MulAdd(s, l.u1, l.u0), inverse_w),
          hn::Mul(hn::MulAdd(s, l.v1, l.v0), inverse_w)};
}

// Direction of the images of a vector of rays along one axis. Without kBothWays all of the block's
// images move forward.
template <bool kBothWays>
struct Direction {
  MF backward;
  explicit HWY_INLINE Direction(VF rate) {
    if constexpr (kBothWays) backward = hn::Lt(rate, hn::Zero(DF()));
  }
  // Returns a for images that move backward, else b.
  HWY_INLINE VF choose(VF a, VF b) const {
    if constexpr (kBothWays)
      return hn::IfThenElse(backward, a, b);
    else
      return b;
  }
  HWY_INLINE VF forward(VF rate) const { return choose(hn::Neg(rate), rate); }
  // Distance from a position to the end of the box ahead [px]. x is relative to the pixel's centre,
  // extent is the distance from there to the box's end.
  HWY_INLINE VF remaining(VF x, VF extent) const { return hn::Sub(extent, choose(hn::Neg(x), x)); }
};

// Returns SkipMap::at() of the box ahead of pixels (fu, fv), which are relative to the origin. A
// pixel outside the stored region is replaced by the nearest stored one, because the pixels between
// the two are empty.
template <bool kBothWays>
HWY_INLINE VF extent_at(const BlockCamera& c, VF& fu, VF& fv,
                        const Direction<kBothWays>& direction_u,
                        const Direction<kBothWays>& direction_v) {
  const DF d;
  const DI di;
  fu = hn::Min(hn::Max(fu, hn::Set(d, c.min_u)), hn::Set(d, c.max_u)),
  fv = hn::Min(hn::Max(fv, hn::Set(d, c.min_v)), hn::Set(d, c.max_v));
  auto offset =
      hn::ConvertTo(di, hn::MulAdd(fv, hn::Set(d, c.step_v), hn::Mul(fu, hn::Set(d, c.step_u))));
  if constexpr (kBothWays) {
    offset = hn::Add(offset, hn::IfThenElseZero(hn::RebindMask(di, direction_u.backward),
                                                hn::Set(di, c.box_bytes)));
    offset = hn::Add(offset, hn::IfThenElseZero(hn::RebindMask(di, direction_v.backward),
                                                hn::Set(di, 2 * c.box_bytes)));
  }
  const auto word =
      hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(c.at_origin), offset);
  return hn::ConvertTo(d, hn::ShiftRight<24>(hn::ShiftLeft<24>(word)));
}

// Returns d/ds (U - b W) of the border b that is `gap_px` px ahead of an image at u, which moves at
// `rate` = d/ds (U - u W). gap_px * W / divisor is the parameter difference to the border. Returns
// kTiny if the image never reaches it.
HWY_INLINE VF divisor(VF gap_px, VF rate, VF w1) {
  const DF d;
  return hn::Max(hn::NegMulAdd(gap_px, w1, rate), hn::Set(d, kTiny));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#endif
