// Vectors of up to 16 floats or 32-bit integers. Each .cpp file that includes this header compiles
// it once per instruction set.
#if defined(FIVEPIPE_BASELINES_SIMD_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FIVEPIPE_BASELINES_SIMD_INL_H
#undef FIVEPIPE_BASELINES_SIMD_INL_H
#else
#define FIVEPIPE_BASELINES_SIMD_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = HWY_CAPPED(float, 16);
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using M = hn::Mask<D>;
constexpr D d;
constexpr DI di;

// Accurate to about two units in the last place, in a third of the time of a division.
HWY_INLINE V reciprocal(V x) {
#if HWY_ARCH_X86
  const V near = hn::ApproximateReciprocal(x);
  return hn::Mul(near, hn::NegMulAdd(x, near, hn::Set(d, 2.0f)));  // one Newton step
#else
  return hn::Div(hn::Set(d, 1.0f), x);
#endif
}

HWY_INLINE M as_float_mask(hn::Mask<DI> m) { return hn::RebindMask(d, m); }

// Bound on the rounding of float positions in images of some thousand pixels: several units in the
// last place.
constexpr float kRounding_px = 1.0f / 64;

}  // namespace fivepipe::baselines::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
