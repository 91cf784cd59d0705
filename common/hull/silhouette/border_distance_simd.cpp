#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/silhouette/border_distance_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "common/hull/silhouette/border_distance_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Returns the smallest sum, over rows nearer than the bound, of the squared distances along and
// across the rows, at columns [column, column + lanes). Takes the rows from the nearest one
// outwards, until none can be smaller.
template <class D>
HWY_INLINE hn::Vec<D> nearest(D d, std::span<const std::int16_t> squares, int width_px, int row,
                              int column, int bound_px) {
  const int rows = int(squares.size()) / width_px;
  const auto along = [&](int from) {
    return hn::LoadU(d, squares.data() + from * width_px + column);
  };
  hn::Vec<D> best = hn::Min(along(row), hn::Set(d, std::int16_t(bound_px * bound_px)));
  for (int away = 1; away < bound_px; ++away) {
    const hn::Vec<D> across = hn::Set(d, std::int16_t(away * away));
    if (hn::AllFalse(d, hn::Gt(best, across))) break;
    if (row >= away) best = hn::Min(best, hn::Add(along(row - away), across));
    if (row + away < rows) best = hn::Min(best, hn::Add(along(row + away), across));
  }
  return best;
}

void distances(const RowDistances& rows, float* distance_px) {
  const hn::CappedTag<std::int16_t, 32> d;
  const int lanes = int(hn::Lanes(d)), width_px = rows.width_px,
            count = int(rows.to_outside.size()) / width_px;
  const auto write = [&](auto tag, int row, int column) {
    alignas(64) std::int16_t to_outside[32], to_inside[32];
    hn::Store(nearest(tag, rows.to_outside, width_px, row, column, rows.outside_bound_px), tag,
              to_outside);
    hn::Store(nearest(tag, rows.to_inside, width_px, row, column, rows.inside_bound_px), tag,
              to_inside);
    float* const at = distance_px + row * width_px + column;
    for (std::size_t i = 0; i < hn::Lanes(tag); ++i)
      at[i] = to_outside[i] > 0 ? std::sqrt(float(to_outside[i])) - 0.5f
                                : 0.5f - std::sqrt(float(to_inside[i]));
  };
  for (int row = 0; row < count; ++row) {
    int column = 0;
    for (; column + lanes <= width_px; column += lanes) write(d, row, column);
    for (; column < width_px; ++column) write(hn::CappedTag<std::int16_t, 1>(), row, column);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::hull {
namespace {
HWY_EXPORT(distances);
}  // namespace

void border_distances(const RowDistances& rows, std::span<float> distance_px) {
  HWY_DYNAMIC_DISPATCH(distances)(rows, distance_px.data());
}

}  // namespace fivepipe::hull
#endif
