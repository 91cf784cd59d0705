// Which part of a tile's rays can meet the hull: tiles are skipped by it, and rays start there.
#pragma once
#include <span>

#include "common/hull/map_from_view.h"

namespace fivepipe::baselines {

// Depths along the view's z [m].
struct DepthRange {
  double begin_m, end_m;
  bool empty() const { return !(begin_m < end_m); }
};

// Holds, for every ray of the rectangle, the part of `within` that lies in all half-spaces, and a
// little more for rounding to float; empty where no ray has such a part.
DepthRange range_of_rays(std::span<const hull::HalfSpace> half_spaces, const hull::PixelRect& rays,
                         const DepthRange& within);

// The squares of kPiece_px into which a view is dealt out to threads, row by row.
inline constexpr int kPiece_px = 64;
int pieces_of(const hull::PixelRect& view);
hull::PixelRect piece_of(const hull::PixelRect& view, int piece);

}  // namespace fivepipe::baselines
