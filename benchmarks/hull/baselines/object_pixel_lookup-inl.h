// The lookups with SIMD. Each .cpp file that includes this header compiles it once per instruction
// set.
#if defined(FIVEPIPE_OBJECT_PIXEL_LOOKUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FIVEPIPE_OBJECT_PIXEL_LOOKUP_INL_H
#undef FIVEPIPE_OBJECT_PIXEL_LOOKUP_INL_H
#else
#define FIVEPIPE_OBJECT_PIXEL_LOOKUP_INL_H
#endif

#include "benchmarks/hull/baselines/object_pixel_lookup.h"
#include "benchmarks/hull/baselines/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines::HWY_NAMESPACE {
// Clamps to [0, max]. NaN becomes one of the two.
HWY_INLINE V clamped(V x, int max) {
  return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, float(max)));
}

HWY_INLINE M on_object(const LookupTables& map, V x, V y) {
  const VI column = hn::ConvertTo(di, clamped(x, map.width_px - 1)),
           row = hn::ConvertTo(di, clamped(y, map.height_px - 1));
  const VI at = hn::Add(hn::Mul(row, hn::Set(di, map.words_per_row)), hn::ShiftRight<5>(column));
  const VI word = hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(map.bits), at);
  return as_float_mask(
      hn::TestBit(word, hn::Shl(hn::Set(di, 1), hn::And(column, hn::Set(di, 31)))));
}

// Whether a rectangle of positions, ends included, certainly holds no object pixel (none), or only
// object pixels (all).
struct Contents {
  M none, all;
};
HWY_INLINE Contents contents_of(const LookupTables& map, V x0, V y0, V x1, V y1) {
  constexpr float kCells = 1.0f / kCell_px;
  const VI one = hn::Set(di, 1), stride = hn::Set(di, map.columns + 1);
  const VI left = hn::ConvertTo(di, hn::Mul(clamped(x0, map.width_px - 1), hn::Set(d, kCells)));
  const VI right =
      hn::Add(hn::ConvertTo(di, hn::Mul(clamped(x1, map.width_px - 1), hn::Set(d, kCells))), one);
  const VI top = hn::ConvertTo(di, hn::Mul(clamped(y0, map.height_px - 1), hn::Set(d, kCells)));
  const VI bottom =
      hn::Add(hn::ConvertTo(di, hn::Mul(clamped(y1, map.height_px - 1), hn::Set(d, kCells))), one);
  const VI above = hn::Mul(top, stride), below = hn::Mul(bottom, stride);
  const auto sum = [&](VI row, VI column) HWY_ATTR {
    return hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(map.cells),
                           hn::Add(row, column));
  };
  const VI sums = hn::Add(hn::Sub(sum(below, right), sum(below, left)),
                          hn::Sub(sum(above, left), sum(above, right)));
  const VI cells = hn::Mul(hn::Sub(right, left), hn::Sub(bottom, top)), low = hn::Set(di, 0xffff);
  const auto countable = hn::Lt(cells, hn::Set(di, kMaxCells));
  const VI any = hn::And(sums, low), all = hn::And(hn::ShiftRight<16>(sums), low);
  return {as_float_mask(hn::And(countable, hn::Eq(any, hn::Zero(di)))),
          as_float_mask(hn::And(countable, hn::Eq(all, cells)))};
}

}  // namespace fivepipe::baselines::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
