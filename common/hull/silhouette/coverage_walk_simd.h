// SIMD kernel of the walks of coverage_walk.h: several rays at once.
#pragma once
#include <cstdint>
#include <span>

namespace fivepipe::hull {

// The map of one camera and the view's rays in it. The cells are those of coverage_walk.h.
struct CoverageSimdCamera {
  double at_eye[3], at_infinity[9];  // MapFromView of the cells' camera; rows one after the other
  const std::uint64_t* whole_cells;  // words of CellsOfMap::all
  int words_per_row, width_cells, height_cells;
  // WalkedMap::coverage. All pixels beyond it are below one half.
  const std::uint8_t* coverage;
  int u0_px, v0_px, width_px, height_px;
};

// Rays through pixels (u_px[i], v_px) of the view, with their parameters [begin[i], end[i]).
struct CoverageSimdRays {
  double v_px;
  std::span<const double> u_px, begin, end;
};

struct CoverageEntry {
  // The first parameter just after which the ray is inside of all silhouettes, or kNever. If it is
  // not resolved, the ray is outside of one of them up to there.
  double t;
  // The camera whose silhouette the ray enters there; -1: the ray starts in the hull.
  std::int32_t camera;
  bool resolved;
};

// Resolves the rays that enter the hull within a few cells, none of which the image's border cuts.
// The result is the same with every instruction set, and that of CoverageWalk up to rounding.
// `entries` has one element per ray (asserted).
void simd_entries(std::span<const CoverageSimdCamera> cameras, const CoverageSimdRays& rays,
                  std::span<CoverageEntry> entries);

}  // namespace fivepipe::hull
