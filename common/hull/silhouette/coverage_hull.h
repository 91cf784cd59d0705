// The visual hull of sub-pixel silhouettes: its depth and normals from any view, exact in double.
//
// A point is in the hull if every camera has it in front of it, in its image, and its coverage
// there, bilinear between pixel centres, is at least one half. Two passes: the hull of the cells
// that may hold something, a superset, by backend `cpu`; from its first point on each ray is walked
// through the cells (coverage_walk.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/silhouette/coverage.h"

namespace fivepipe::hull {

// False where there is no camera, and for NaN. In double.
bool in_hull(std::span<const CoverageSilhouette> silhouettes, const Eigen::Vector3d& p_world_m);

// Unit normal of the hull's surface at p, world, outward, where this silhouette limits the hull:
// that of the plane through the camera's centre and the border's tangent (outward_in_image), P^T l.
// Nothing where p has no image, or its coverage no direction.
std::optional<Eigen::Vector3d> outward_normal_world(const CoverageSilhouette& silhouette,
                                                    const Eigen::Vector3d& p_world_m);

struct SurfaceTile {
  PixelRect rect;
  std::vector<float> depth_m;  // as of DepthTile
  // Unit, outward; zero where the ray has no hull, or where the near plane or an image's border,
  // not the object's, limits it.
  std::vector<Eigen::Vector3f> normal_world;
  std::vector<std::int16_t>
      limiting;  // index of the silhouette that limits there, as given; -1 where the normal is zero
};

// One frame set made ready for any number of queries, one at a time.
class CoverageHull {
 public:
  explicit CoverageHull(base::WorkerPool& pool);  // borrows it
  CoverageHull(base::WorkerPool& pool, std::span<const CoverageSilhouette> silhouettes);
  // Takes the place of what was there. Maps have the sizes of their pinholes. Cameras that are not
  // finite leave no hull.
  void assign(std::span<const CoverageSilhouette> silhouettes);

  // Depth of the view's rays through the pixels of `rect`, row by row into depth_m, of rect's size.
  // The same bits for every order of the silhouettes and number of threads. A view that is not
  // finite sees no hull.
  void depth(const View& view, const PixelRect& rect, std::span<float> depth_m);
  DepthTile depth(const View& view, const PixelRect& rect);
  SurfaceTile surface(const View& view, const PixelRect& rect);

 private:
  struct MapCamera {
    CoverageSilhouette silhouette;
    int given;  // index in what was given
    const SkipMap* skip_map;
  };
  template <class Found>
  void trace(const View& view, const PixelRect& rect, std::span<float> depth_m, const Found& found);

  base::WorkerPool* pool_;
  CpuHull superset_;
  std::vector<MapCamera> cameras_;
};

}  // namespace fivepipe::hull
