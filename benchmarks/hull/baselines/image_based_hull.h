// Baseline: image-based visual hulls. It intersects each ray's image with the border of each
// camera's silhouette, and then the intervals of all cameras. Source: Matusik, Buehler, Raskar,
// Gortler, McMillan, "Image-Based Visual Hulls", SIGGRAPH 2000: section 3.1 with its edge bins,
// section 3.2 for the coherence between neighbouring rays.
//
// Optimised for a fair comparison:
// - Borders are exact (the pixels' squares, collinear runs merged), so depths equal those of the
//   exact hull up to rounding to float.
// - Bins are uniform in the epipolar line's number, an eighth of a pixel wide, and store their
//   edges: most edges need no test of their ends, one load reads two, and positions on a line need
//   no division.
// - Nothing is sorted. A ray gets from a camera the one interval that it needs next, in one pass by
//   parity, and returns to the camera only after other cameras have moved it past that interval.
// - A tile of 8x8 rays first finds the range of positions of the edges in its wedge of lines. It is
//   skipped if that range is empty, and starts there otherwise.
// - SIMD lanes hold blocks of neighbouring rays; threads share tiles and cameras.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "benchmarks/hull/baselines/epipolar_bins.h"
#include "common/base/worker_pool.h"
#include "common/hull/hull.h"

namespace fivepipe::baselines {

class ImageBasedHull {
 public:
  // Writes the depth in m along the view's z for each pixel, row-major; kNoHull if there is no hull
  // between near and far. depth_m has the view's width * height elements. Uses `limits: all`.
  // Keeps its buffers from call to call. The result does not depend on the pool's threads.
  void depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
             base::WorkerPool& pool, std::span<float> depth_m);

 private:
  struct MapCamera {
    hull::PixelRect bounds;
    hull::MapFromView map;
    EpipolarBins bins;
    bool at_eye;  // its center is the view's, so each ray is one point in its map
  };
  bool prepare(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
               base::WorkerPool& pool);

  std::vector<MapCamera> cameras_;
  std::vector<hull::HalfSpace> half_spaces_;
};

// One camera for the SIMD kernel. The image of the ray through (u, v) at depth t is at_eye + t *
// (of_u u + of_v v + of_1), homogeneous, in the bins' map coordinates.
struct EpipolarCamera {
  std::array<float, 3> at_eye, of_u, of_v, of_1;
  std::span<const Sector> sectors;
  const std::int32_t *whole_first, *part_first;
  const std::int32_t* whole;  // two edges per entry
  const std::int32_t* part;
  const std::uint32_t* part_steps;
  const float *nearest, *farthest;
  std::int32_t groups, empty_bin;
  bool ends_inside;
};
// Traces the rays of a tile of the view from begin_m to end_m. Writes row v of the tile to depth_m
// + v * stride.
struct EpipolarTile {
  hull::PixelRect rays;
  float begin_m, end_m;
  float* depth_m;  // of the first ray
  std::size_t stride;
};
void trace_tile(std::span<const EpipolarCamera> cameras, const EpipolarTile& tile);

// The depth ranges in which the rays of each tile of a piece may be inside all silhouettes. The
// tiles are squares of kTile_px, row by row, kTilesAcross per row. A range is empty if begin >=
// end.
inline constexpr int kTile_px = 8, kTilesAcrossBits = 3, kTilesAcross = 1 << kTilesAcrossBits;
struct TileRanges {
  float begin_m[kTilesAcross * kTilesAcross], end_m[kTilesAcross * kTilesAcross];
};
void narrow_tiles(std::span<const EpipolarCamera> cameras, const hull::PixelRect& piece,
                  float begin_m, float end_m, TileRanges& ranges);

}  // namespace fivepipe::baselines
