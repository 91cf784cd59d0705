// Backend `cpu`: volume queries on the CPU, exact to rounding in double (design, "Rays"). Rays are
// traced in vector lanes with certified margins (ray_lanes.h); those that the margins leave open,
// and whatever the lanes have no use for, in double (ray_walk.h).
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/hull/cpu/skip_map.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// One frame set made ready for any number of queries, one at a time: they share the pool, and make
// what they are the first to need.
class CpuHull {
 public:
  explicit CpuHull(base::WorkerPool& pool);  // borrows it
  CpuHull(base::WorkerPool& pool, std::span<const Silhouette> silhouettes,
          const HullRule& rule = {});
  ~CpuHull();
  // Takes the place of what was there; reuses the memory. Silhouettes that are not finite leave no
  // hull.
  void assign(std::span<const Silhouette> silhouettes, const HullRule& rule = {});

  // Depth of the view's rays through the pixels of `rect`, which may extend beyond its image, row
  // by row into depth_m, of rect's size. The same bits for every order of the silhouettes, division
  // of the view into rects, and number of threads; within 2e-6 of the exact reference, relative. A
  // view that is not finite sees no hull.
  void depth(const View& view, const PixelRect& rect, std::span<float> depth_m);
  DepthTile depth(const View& view, const PixelRect& rect);

  // In the order in which they are asked, which does not depend on the order given.
  struct MapCamera {
    geometry::Camera camera;
    SkipMap skip_map;
    int silhouette;  // index in what was given
  };
  std::span<const MapCamera> cameras() const { return {cameras_.data(), used_}; }
  const HullRule& rule() const { return rule_; }
  // All boxes of all cameras that are not made yet, in the pool. Afterwards depth makes none.
  void make_all_quadrants();
  base::WorkerPool& pool() const { return *pool_; }
  // Nothing is in the hull: no camera, one that is not finite, or, where all limit, one without an
  // object pixel.
  bool empty() const { return empty_; }
  // That is so because a camera is not finite: nothing is known.
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
