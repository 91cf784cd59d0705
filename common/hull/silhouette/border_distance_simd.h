// SIMD kernel of the distance transform (border_distance.h).
#pragma once
#include <cstdint>
#include <span>

namespace fivepipe::hull {

// Squared distances along the rows to the nearest pixel outside and inside the object, at most the
// square of their bound. One of the two is 0 at each pixel. Row-major.
struct RowDistances {
  std::span<const std::int16_t> to_outside, to_inside;
  int width_px;
  int outside_bound_px, inside_bound_px;
};
// Writes the signed distance of each pixel's centre to the border: that in the plane, less half a
// pixel; positive inside. The result is the same with every instruction set.
void border_distances(const RowDistances& rows, std::span<float> distance_px);

}  // namespace fivepipe::hull
