// SIMD kernel of the walks of coverage_walk.h: several rays at once.
#pragma once
#include <cstdint>
#include <span>

#include "common/hull/coverage/coverage_walk.h"

namespace fivepipe::hull {

// The map of one camera and the view's rays in it. The cells are those of coverage_walk.h. Both
// objects must outlive it.
struct CoverageSimdCamera {
  CoverageSimdCamera(const MapFromView& map_from_view, const WalkedMap& walked);

  double at_eye[3], at_infinity[9];  // MapFromView of the cells' camera; rows one after the other
  const std::uint64_t* whole_cells;  // words of CellsOfMap::all
  int words_per_row, width_cells, height_cells;
  // WalkedMap::coverage and corners. All pixels beyond them are below one half.
  const std::uint8_t* coverage;
  int u0_px, v0_px, width_px, height_px;
};

// Rays through pixels (u_px[i], v_px) of the view, with their parameters [begin[i], end[i]).
struct CoverageSimdRays {
  double v_px;
  std::span<const double> u_px, begin, end;
};

// Resolves the rays that enter the hull, or leave all images, within a few cells. The begin of a
// resolved ray is in the images of all cameras. The result is the same with every instruction set,
// and that of next_entry() up to rounding. `entries` has one element per ray (asserted). Does
// nothing without cameras.
void simd_entries(std::span<const CoverageSimdCamera> cameras, const CoverageSimdRays& rays,
                  std::span<CoverageEntry> entries);

}  // namespace fivepipe::hull
