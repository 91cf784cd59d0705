// Baseline: the paper's plane sweep on the CPU with SIMD.
// Source: Lok's volume query by plane sweep (section 3.2 of the paper; see
// common/hull/paper/plane_sweep.h). The planes are orthogonal to the view direction, from near to
// far. A homography projects each camera's object pixels onto the plane; a pixel that is covered by
// object pixels of all cameras gets the plane's depth.
//
// Optimised for a fair comparison:
// - Planes are swept front to back, and a tile of rays ends when all its rays have a depth.
// - A tile sweeps only the planes on which it intersects every camera's bounds. For several of
//   these at a time, counts over 4x4 cells report whether the tile's image in a camera holds no
//   object pixel (the plane is skipped) or only object pixels (the camera needs no lookups).
// - SIMD lanes look up the remaining rays: one multiply-add per coordinate for the homography, a
//   reciprocal, and one gather of packed bits in the first-level cache. The cameras after the one
//   that removes a vector's last ray are skipped.
// - Threads share tiles and cameras.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "benchmarks/hull/baselines/object_pixel_lookup.h"
#include "common/base/worker_pool.h"
#include "common/hull/hull.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::baselines {

inline constexpr std::size_t kMaxSweptCameras = 64;

// The depth of a ray that first hits the hull on plane k. `plane`: the plane's depth, as in the
// paper, up to one spacing too far. `centered`: half a spacing less, which halves the error.
enum class SweptDepth { plane, centered };
// The planes that a tile sweeps. `by_counts`: those on which its footprint in each map holds object
// pixels. `by_bounds`: all within the maps' bounds, as in the paper.
enum class SweptPlanes { by_counts, by_bounds };

// Finds a ray's first hull point at the first plane behind it. It may miss pieces of the hull that
// are thinner than the spacing.
class CpuPlaneSweep {
 public:
  explicit CpuPlaneSweep(int planes, SweptDepth depth = SweptDepth::plane,
                         SweptPlanes swept = SweptPlanes::by_counts)
      : planes_(planes), reported_(depth), swept_(swept) {}  // > 0

  // Plane k of `planes` is at near + k * (far - near) / planes. Writes the depth in m along the
  // view's z for each pixel, row-major; kNoHull if no plane hits the hull. depth_m has the view's
  // width * height elements. The hull rule is `limits: all`. Throws std::invalid_argument for more
  // than kMaxSweptCameras cameras. Keeps its buffers from call to call. The result does not depend
  // on the pool's threads.
  void depth(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
             base::WorkerPool& pool, std::span<float> depth_m);

 private:
  struct MapCamera {
    hull::PixelRect bounds;
    hull::MapFromView map;
    ObjectPixelLookup lookup;
  };
  bool prepare(std::span<const hull::Silhouette> silhouettes, const hull::View& view,
               base::WorkerPool& pool);

  int planes_;
  SweptDepth reported_;
  SweptPlanes swept_;
  std::vector<MapCamera> cameras_;
  std::vector<hull::HalfSpace> half_spaces_;
};

// One camera for the SIMD kernel. The position in its tables of the point at depth t on the ray
// through (u, v) is at_eye + t * (of_u u + of_v v + of_1), homogeneous.
struct SweptCamera {
  std::array<float, 3> at_eye, of_u, of_v, of_1;
  LookupTables map;
};
// Planes [first_plane, end_plane) at near_m + k * step_m, for a tile of at most kSweptTile_px
// squared. sweep_tile() writes the depths that it finds in row v of the tile to depth_m + v *
// stride.
inline constexpr int kSweptTile_px = 16;
struct SweptTile {
  hull::PixelRect rays;
  int first_plane, end_plane;
  float near_m, step_m;
  float before_m;  // subtracted from the plane's depth, except on the first plane
  float* depth_m;
  std::size_t stride;
  SweptPlanes swept = SweptPlanes::by_counts;
};
void sweep_tile(std::span<const SweptCamera> cameras, const SweptTile& tile);

}  // namespace fivepipe::baselines
