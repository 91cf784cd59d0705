// The visual hull of sub-pixel silhouettes: its depth and normals from any view, exact in double.
//
// A point is in the hull if it is in the rule's box, in front of every camera and in its image, and
// its interpolated coverage there is at least one half. Depth takes two passes: backend `cpu` finds
// the first point of a superset, the hull of all cells that may be covered; from there each ray is
// walked through the cells (coverage_walk.h), several rays at a time (coverage_walk_simd.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/coverage/coverage_normal.h"
#include "common/hull/coverage/coverage_walk.h"
#include "common/hull/coverage/coverage_walk_simd.h"
#include "common/hull/coverage/sparse_coverage.h"
#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::hull {

// Returns true if p is in the hull, without a box. Returns false if there is no camera or a
// coordinate is not finite. Computes in double.
bool in_hull(std::span<const CoverageSilhouette> silhouettes, const Eigen::Vector3d& p_world_m);

struct SurfaceTile {
  PixelRect rect;
  std::vector<float> depth_m;  // as in DepthTile
  // Outward unit normals. Zero if the ray meets no hull, if the near plane, the rule's box or an
  // image's border limits the hull there, or if outward_normal_world() returns nullopt.
  std::vector<Eigen::Vector3f> normal_world;
  // Index of the silhouette that limits the hull there, in the silhouettes given to assign(); -1 if
  // the normal is zero.
  std::vector<std::int16_t> limiting;
};

// The silhouettes of one frame set, prepared for queries. Run one query at a time.
class CoverageHull {
 public:
  explicit CoverageHull(base::WorkerPool& pool);  // the pool must outlive the hull
  CoverageHull(base::WorkerPool& pool, std::vector<CoverageSilhouette> silhouettes,
               const HullRule& rule = {});
  // Replaces the silhouettes. If a camera is not finite, the hull is empty. The rule has
  // Limits::all (asserted).
  void assign(std::vector<CoverageSilhouette> silhouettes, const HullRule& rule = {});

  // Writes the depth of the view's rays through the pixels of `rect` to depth_m (see DepthTile),
  // which must have the rect's size. The bits do not depend on the order of the silhouettes or the
  // number of threads. A view that is not finite has no hull.
  void depth(const View& view, const PixelRect& rect, std::span<float> depth_m);
  DepthTile depth(const View& view, const PixelRect& rect);
  // Returns depth(), normals and limiting silhouettes of the rays through the pixels of `rect`.
  SurfaceTile surface(const View& view, const PixelRect& rect);

 private:
  struct MapCamera {
    CoverageSilhouette silhouette;
    int given;  // index in the silhouettes given to assign()
    WalkedMap walked;
    const SkipMap* skip_map;
  };
  struct Row;
  void collect(Row& row, const View& view, int u0_px, double v_px, std::span<float> depth_m) const;
  template <class Found>
  void trace(const View& view, const PixelRect& rect, std::span<float> depth_m, const Found& found);

  base::WorkerPool* pool_;
  CpuHull superset_;
  std::vector<MapCamera> cameras_;
};

}  // namespace fivepipe::hull
