// Rival: the paper's plane sweep, on the CPU in vector lanes.
// Source: Lok's volume querying by plane sweep (the paper's section 3.2; see
// common/hull/plane_sweep.h): planes orthogonal to the view direction from near to far, each
// camera's object pixels projected onto the plane by a homography; a pixel that is on object pixels
// of all cameras gets the plane's depth.
//
// Done to be fair. Planes go front to back, and a tile of rays is done when all its rays are. A
// tile takes only the planes on which it meets every camera's bounds. Of those, many at a time, it
// asks of each camera whether the tile's image on the plane holds no object pixel (the plane is
// skipped) or nothing else (the camera is not looked up), by counts over 4x4 cells. What is left is
// looked up ray by ray in lanes: the homography by one multiply-add a coordinate, a reciprocal, one
// gather of packed bits that stay in the first cache level; cameras stop where no ray of a vector
// is left. Tiles and cameras are threaded.
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

// What a ray is given that is first in the hull on plane k: the plane's depth, as the paper does,
// up to a spacing too far; or, half a spacing before it, the middle of where the hull may begin,
// with half the error.
enum class SweptDepth { plane, middle };
// Which planes of a tile its rays are looked up on: those on which its footprint in each map holds
// object pixels, by counts; or all that lie within the maps' bounds, as in the paper.
enum class SweptPlanes { by_counts, by_bounds };

// A ray's first hull point is found at the first plane behind it; pieces thinner than the spacing
// may be passed.
class CpuPlaneSweep {
 public:
  explicit CpuPlaneSweep(int planes, SweptDepth depth = SweptDepth::plane,
                         SweptPlanes swept = SweptPlanes::by_counts)
      : planes_(planes), reported_(depth), swept_(swept) {}  // > 0

  // Plane k of `planes` is at near + k * (far - near) / planes. Depth along the view's z [m] of
  // each pixel, row-major; kNoHull where no plane has hull. At most kMaxSweptCameras, else
  // std::invalid_argument. depth_m has the view's width * height. `limits: all`. Keeps its buffers
  // from call to call. Does not depend on the pool's threads.
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

// One camera as the lanes read it: the position, in its tables, of the point at depth t on the ray
// through (u, v) is at_eye + t * (of_u u + of_v v + of_1), homogeneous.
struct SweptCamera {
  std::array<float, 3> at_eye, of_u, of_v, of_1;
  LookupTables map;
};
// Planes [first, end) at near + k * step [m] for a tile of at most kSweptTile_px squared; depths of
// the row v of the tile are written to depth_m + v * stride where they are found.
inline constexpr int kSweptTile_px = 16;
struct SweptTile {
  hull::PixelRect rays;
  int first_plane, end_plane;
  float near_m, step_m;
  float before_m;  // by which reported depths lie before their plane, but for the first
  float* depth_m;
  std::size_t stride;
  SweptPlanes swept = SweptPlanes::by_counts;
};
void sweep_tile(std::span<const SweptCamera> cameras, const SweptTile& tile);

}  // namespace fivepipe::baselines
