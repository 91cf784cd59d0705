// Backend `cpu`: hull depth on the CPU, exact to rounding in double. SIMD kernels trace rays in
// float with certified error bounds (ray_simd.h). Rays that the bounds leave uncertain, and views
// that the kernels do not support, are traced in double (ray_walk.h).
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/hull/cpu/skip_map.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// The silhouettes of one frame set, prepared for queries. Run one query at a time: queries share
// the pool, and a query creates the quadrants of the skip maps that it needs and that do not exist
// yet.
class CpuHull {
 public:
  explicit CpuHull(base::WorkerPool& pool);  // the pool must outlive the hull
  CpuHull(base::WorkerPool& pool, std::span<const Silhouette> silhouettes,
          const HullRule& rule = {});
  ~CpuHull();
  // Replaces the silhouettes and reuses the memory. If a camera is not finite, the hull is empty.
  void assign(std::span<const Silhouette> silhouettes, const HullRule& rule = {});

  // Writes the depth of the view's rays through the pixels of `rect` to depth_m (see DepthTile),
  // which must have the rect's size. The rect may extend beyond the view's image. The bits do not
  // depend on the order of the silhouettes, the division of the view into rects or the number of
  // threads. The relative error against the exact reference is at most 2e-6. A view that is not
  // finite has no hull.
  void depth(const View& view, const PixelRect& rect, std::span<float> depth_m);
  DepthTile depth(const View& view, const PixelRect& rect);

  struct MapCamera {
    geometry::Camera camera;
    SkipMap skip_map;
    int silhouette;  // index in the silhouettes given to assign()
  };
  // The cameras in the order in which queries test them, which does not depend on the order given
  // to assign(). Valid until the next assign(). Empty if there is no silhouette or a camera is not
  // finite.
  std::span<const MapCamera> cameras() const { return {cameras_.data(), used_}; }
  const HullRule& rule() const { return rule_; }
  // Creates all missing quadrants of all skip maps, in the pool. depth() then creates none.
  void make_all_quadrants();
  base::WorkerPool& pool() const { return *pool_; }
  // Returns true if there is no camera, if a camera is not finite, or if the rule is Limits::all
  // and a camera has no object pixel.
  bool empty() const { return empty_; }
  // Returns true if a camera is not finite. The true hull is then unknown.
  bool unusable() const { return unusable_; }

 private:
  struct ViewJob;
  class Tracer;
  struct VisibleBlock;
  std::vector<VisibleBlock> visible_blocks(const ViewJob& job);
  void make_quadrants(const ViewJob& job, std::span<const VisibleBlock> blocks);

  base::WorkerPool* pool_;
  std::vector<std::unique_ptr<Tracer>> tracers_;  // one per thread
  HullRule rule_;
  std::vector<MapCamera> cameras_;
  std::size_t used_ = 0;
  bool empty_ = true, unusable_ = false;
};

}  // namespace fivepipe::hull
