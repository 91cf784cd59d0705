#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "benchmarks/collision/baselines/brute_force_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "benchmarks/collision/baselines/brute_force_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = HWY_CAPPED(float, 16);
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;

// Bound on the rounding of a sample's pixel: three coefficients, two products, two sums and the
// quotient, half an epsilon each, times two.
constexpr float kRoundings = 8 * std::numeric_limits<float>::epsilon();
// If a sample's depth is less than this fraction of the triangle's extent, rounding makes its pixel
// meaningless.
constexpr float kMinDepth = 1.0f / 4096;

std::size_t covered(const float* x, const float* y, std::size_t count, float apex_x, float* base,
                    float* side) {
  const D d;
  const V apex = hn::Set(d, apex_x), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  std::size_t found = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const V sides = hn::LoadU(d, y + i), bases = hn::Sub(hn::LoadU(d, x + i), hn::Mul(sides, apex));
    const auto in = hn::And(hn::FirstN(d, count - i),
                            hn::And(hn::Ge(bases, zero), hn::Le(bases, hn::Sub(one, sides))));
    hn::CompressStore(sides, in, d, side + found);
    found += hn::CompressStore(bases, in, d, base + found);
  }
  return found;
}

void in_hull(std::span<const SampledMap> maps, const float* base, const float* side,
             std::size_t count, hull::InHull* verdicts) {
  const D d;
  const DI di;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  for (std::size_t first = 0; first < count; first += hn::Lanes(d)) {
    const V b = hn::LoadU(d, base + first), s = hn::LoadU(d, side + first);
    auto in = hn::FirstN(d, count - first), uncertain = hn::Lt(zero, zero);
    for (const SampledMap& m : maps) {
      const auto at = [&](int i) {
        return hn::Add(hn::Set(d, m.of_1[i]), hn::Add(hn::Mul(b, hn::Set(d, m.of_base[i])),
                                                      hn::Mul(s, hn::Set(d, m.of_side[i]))));
      };
      const V w = at(2), per_w = hn::Div(one, w);
      const auto far = hn::Gt(w, hn::Set(d, kMinDepth * m.size[2]));
      // The position on one axis and its error bound, in px.
      const auto error = [&](V px, int i) {
        return hn::Mul(hn::Set(d, kRoundings),
                       hn::Add(hn::Mul(hn::Add(hn::Set(d, m.size[i]),
                                               hn::Mul(hn::Abs(px), hn::Set(d, m.size[2]))),
                                       per_w),
                               hn::Abs(px)));
      };
      const V u = hn::Mul(at(0), per_w), v = hn::Mul(at(1), per_w), eu = error(u, 0),
              ev = error(v, 1);
      const auto beyond = [&](V px, V e, float low, float high) {
        return hn::Or(hn::Lt(hn::Add(px, e), hn::Set(d, low)),
                      hn::Gt(hn::Sub(px, e), hn::Set(d, high)));
      };
      const auto out =
          hn::And(far, hn::Or(beyond(u, eu, m.u0_px, m.u1_px), beyond(v, ev, m.v0_px, m.v1_px)));
      in = hn::AndNot(out, in);
      if (hn::AllFalse(d, in)) break;
      const V whole_u = hn::Floor(u), whole_v = hn::Floor(v);
      const auto sure = [&](V px, V whole, V e) {
        return hn::And(hn::Gt(hn::Sub(px, whole), e), hn::Lt(hn::Add(hn::Sub(px, whole), e), one));
      };
      const auto certain = hn::And(far, hn::And(sure(u, whole_u, eu), sure(v, whole_v, ev)));
      uncertain = hn::Or(uncertain, hn::AndNot(certain, in));
      in = hn::And(in, certain);
      if (hn::AllFalse(d, in)) continue;
      // Lanes that are not certainly within the bounds read the map's first word.
      const auto bit =
          hn::Add(hn::Add(hn::ConvertTo(di, whole_u),
                          hn::Mul(hn::ConvertTo(di, whole_v), hn::Set(di, m.row_bits))),
                  hn::Set(di, m.first_bit));
      const auto safe = hn::IfThenElseZero(hn::RebindMask(di, in), bit);
      const auto words = hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(m.bits),
                                         hn::ShiftRight<5>(safe));
      const auto set = hn::TestBit(words, hn::Shl(hn::Set(di, 1), hn::And(safe, hn::Set(di, 31))));
      in = hn::And(in, hn::RebindMask(d, set));
      if (hn::AllFalse(d, hn::Or(in, uncertain))) break;
    }
    // A sample that one camera leaves uncertain and another removes counts as uncertain; testing it
    // again is correct.
    alignas(64) std::int32_t result[16];
    hn::Store(hn::IfThenElse(hn::RebindMask(di, uncertain), hn::Set(di, 2),
                             hn::IfThenElseZero(hn::RebindMask(di, in), hn::Set(di, 1))),
              di, result);
    for (std::size_t i = 0; i < hn::Lanes(d) && first + i < count; ++i)
      verdicts[first + i] = hull::InHull(result[i]);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::baselines
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::baselines {
namespace {
HWY_EXPORT(covered);
HWY_EXPORT(in_hull);
}  // namespace

std::size_t covered_samples(const float* x, const float* y, std::size_t count, float apex_x,
                            float* base, float* side) {
  return HWY_DYNAMIC_DISPATCH(covered)(x, y, count, apex_x, base, side);
}

void samples_in_hull(std::span<const SampledMap> maps, const float* base, const float* side,
                     std::size_t count, hull::InHull* verdicts) {
  HWY_DYNAMIC_DISPATCH(in_hull)(maps, base, side, count, verdicts);
}

}  // namespace fivepipe::baselines
#endif
