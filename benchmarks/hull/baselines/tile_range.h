// The depth range in which a tile's rays can hit the hull. Tiles with an empty range are skipped,
// and rays start at its beginning.
#pragma once
#include <span>

#include "common/hull/map_from_view.h"

namespace fivepipe::baselines {

// Depths in m along the view's z.
struct DepthRange {
  double begin_m, end_m;
  bool empty() const { return !(begin_m < end_m); }
};

// Returns a range that contains, for every ray of the rectangle, the part of `within` that is in
// all half-spaces, widened for rounding to float. Empty if no ray has such a part.
DepthRange range_of_rays(std::span<const hull::HalfSpace> half_spaces, const hull::PixelRect& rays,
                         const DepthRange& within);

// The threads share a view in square pieces of kPiece_px, numbered row by row.
inline constexpr int kPiece_px = 64;
int pieces_of(const hull::PixelRect& view);
hull::PixelRect piece_of(const hull::PixelRect& view, int piece);

}  // namespace fivepipe::baselines
