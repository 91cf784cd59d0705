// Rival: image-based visual hulls. Each camera's silhouette border, each ray's image intersected
// with it, the in/out intervals of all cameras intersected. Source: Matusik, Buehler, Raskar,
// Gortler, McMillan, "Image-Based Visual Hulls", SIGGRAPH 2000: section 3.1 with its edge bins,
// section 3.2's coherence between neighbouring rays.
//
// Done to be fair. Borders are exact (the pixels' squares, collinear runs merged), so that depths
// are those of the exact hull but for rounding to float. Bins are even in the epipolar line's
// number, an eighth of a pixel wide, and hold their edges themselves: most need no test of their
// ends, two come with one load, and positions on a line take no division. Nothing is sorted: a ray
// takes from a camera the one interval that it needs next, in one pass by parity, and comes back
// only when other cameras have moved it past that. Tiles of 8x8 rays ask first between which
// positions the edges of their wedge of lines lie, and are skipped or start there. Rays go in
// blocks of neighbours in vector lanes, tiles and cameras in threads.
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
  // Depth along the view's z [m] of each pixel, row-major; kNoHull where there is no hull between
  // near and far. depth_m has the view's width * height. `limits: all`. Keeps its buffers from call
  // to call. Does not depend on the pool's threads.
  void depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
             base::WorkerPool& pool, std::span<float> depth_m);

 private:
  struct MapCamera {
    hull::PixelRect bounds;
    hull::MapFromView map;
    EpipolarBins bins;
    bool at_eye;  // its centre is the view's: each ray is one point in its map
  };
  bool prepare(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
               base::WorkerPool& pool);

  std::vector<MapCamera> cameras_;
  std::vector<hull::HalfSpace> half_spaces_;
};

// One camera as the lanes read it: the image of the ray through (u, v) is at_eye + t * (of_u u +
// of_v v + of_1), homogeneous, in the bins' map coordinates.
struct EpipolarCamera {
  std::array<float, 3> at_eye, of_u, of_v, of_1;
  std::span<const Sector> sectors;
  const std::int32_t *whole_first, *part_first;
  const std::int32_t* whole;  // two edges each
  const std::int32_t* part;
  const std::uint32_t* part_steps;
  const float *nearest, *farthest;
  std::int32_t groups, empty_bin;
  bool ends_inside;
};
// Traces the rays of a tile of the view from begin to end [m]; row v of the tile is written to
// depth_m + v * stride.
struct EpipolarTile {
  hull::PixelRect rays;
  float begin_m, end_m;
  float* depth_m;  // of the first ray
  std::size_t stride;
};
void trace_tile(std::span<const EpipolarCamera> cameras, const EpipolarTile& tile);

// Where the rays of each tile of a piece may be in the silhouettes: of its kTile_px squares, row by
// row, kTilesAcross a row; empty where begin >= end.
inline constexpr int kTile_px = 8, kTilesAcrossBits = 3, kTilesAcross = 1 << kTilesAcrossBits;
struct TileRanges {
  float begin_m[kTilesAcross * kTilesAcross], end_m[kTilesAcross * kTilesAcross];
};
void narrow_tiles(std::span<const EpipolarCamera> cameras, const hull::PixelRect& piece,
                  float begin_m, float end_m, TileRanges& ranges);

}  // namespace fivepipe::baselines
