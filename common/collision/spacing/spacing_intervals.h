// Sets of spacings, as ascending, disjoint, closed intervals.
#pragma once
#include <algorithm>
#include <vector>

#include "common/collision/spacing/spacing_sweep.h"

namespace fivepipe::collision {

// Covers the rounding of a ball's radius and of the interval in which its centre stays in it.
inline constexpr double kBelowOne = 1 - 1e-9;

// Adds an interval to ascending, disjoint ones.
inline void add(std::vector<SpacingInterval>& intervals, SpacingInterval added) {
  const auto first = std::ranges::find_if(
      intervals, [&](const SpacingInterval& i) { return i.high_m >= added.low_m; });
  auto last = first;
  for (; last != intervals.end() && last->low_m <= added.high_m; ++last)
    added = {std::min(added.low_m, last->low_m), std::max(added.high_m, last->high_m)};
  intervals.insert(intervals.erase(first, last), added);
}

}  // namespace fivepipe::collision
