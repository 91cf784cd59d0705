#include "common/hull/query/hull_query.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/hull/cpu/point_simd.h"
#include "common/hull/cpu/ray_walk.h"

namespace fivepipe::hull {
namespace {

using Eigen::Vector3d;

// Queries per work item: large enough that the pool's overhead is negligible.
constexpr int kBatchSize = 256;

// Calls part(begin, end) in the pool for each batch of [0, count).
template <class Part>
void for_batches(base::WorkerPool& pool, std::size_t count, const Part& part) {
  pool.run(int((count + kBatchSize - 1) / kBatchSize), [&](int piece, int) {
    const std::size_t begin = std::size_t(piece) * kBatchSize;
    part(begin, std::min(begin + kBatchSize, count));
  });
}

}  // namespace

HullQuery::HullQuery(CpuHull& hull) : hull_(&hull) {
  hull.make_all_quadrants();
  for (const CpuHull::MapCamera& c : hull.cameras()) {
    const ImageCone cone(c.camera);
    cones_.push_back({cone, cone.pyramid(c.skip_map.bounds()), cone.pyramid(image_of(c.camera))});
  }
}

bool HullQuery::contains(const Vector3d& p_world_m) const {
  if (hull_->empty() || !p_world_m.allFinite() || !hull_->rule().within_world_m.contains(p_world_m))
    return false;
  const bool all = hull_->rule().limits == Limits::all;
  int seen = 0;
  for (const CpuHull::MapCamera& c : hull_->cameras()) {
    const auto uv_px = geometry::project(c.camera, p_world_m);
    const bool sees = uv_px && holds(image_of(c.camera), uv_px->x(), uv_px->y());
    if (!sees && !all) continue;
    if (!sees ||
        c.skip_map.at(Quadrant::right_down, int(uv_px->x() + 0.5), int(uv_px->y() + 0.5)) > 0)
      return false;
    ++seen;
  }
  return all || seen >= hull_->rule().min_seen;
}

// Calls take(interval) for each interval until it returns false.
template <class Take>
void HullQuery::each_interval(const geometry::Ray& ray, double near, double far,
                              const Take& take) const {
  if (hull_->empty() || !(near < far) || !std::isfinite(near) || !std::isfinite(far) ||
      !ray.origin_world_m.allFinite() || !ray.direction_world.allFinite())
    return;
  const HullRule& rule = hull_->rule();
  const RayRange in_box = range_in_box(rule.within_world_m, ray, {near, far});
  near = in_box.begin, far = in_box.end;
  if (in_box.empty()) return;
  std::vector<MapWalk> walks;
  walks.reserve(cones_.size());
  for (const CpuHull::MapCamera& c : hull_->cameras()) {
    walks.emplace_back(image_line(c.camera, ray), c.skip_map,
                       walk_window(c.camera, c.skip_map, rule), beyond_window(rule),
                       RayRange{near, far});
  }
  RayWalk walk(walks, rule);
  for (double t = near; t < far;) {
    Interval found{walk.next_entry(t, far), 0};
    if (!(found.enter < far)) return;
    found.leave = walk.next_exit(found.enter, far);
    if (found.enter < found.leave && !take(found)) return;
    t = found.leave;
  }
}

std::vector<Interval> HullQuery::intervals(const geometry::Ray& ray, double near,
                                           double far) const {
  std::vector<Interval> found;
  each_interval(ray, near, far, [&](const Interval& i) {
    if (!found.empty() && found.back().leave == i.enter)
      found.back().leave = i.leave;
    else
      found.push_back(i);
    return true;
  });
  return found;
}

std::optional<double> HullQuery::first_entry(const geometry::Ray& ray, double near,
                                             double far) const {
  std::optional<double> entry;
  each_interval(ray, near, far, [&](const Interval& i) {
    entry = i.enter;
    return false;
  });
  return entry;
}

void HullQuery::contains(std::span<const Vector3d> p_world_m,
                         std::span<std::uint8_t> inside) const {
  assert(inside.size() == p_world_m.size());
  if (hull_->empty() || hull_->rule().limits == Limits::seen)
    return for_batches(hull_->pool(), p_world_m.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) inside[i] = contains(p_world_m[i]);
    });
  const std::vector<PointSimdCamera> cameras = point_simd_cameras(*hull_);
  for_batches(hull_->pool(), p_world_m.size(), [&](std::size_t begin, std::size_t end) {
    InHull verdicts[kBatchSize];
    contains_simd(cameras, p_world_m.subspan(begin, end - begin), verdicts);
    for (std::size_t i = begin; i < end; ++i)
      inside[i] = verdicts[i - begin] == InHull::uncertain
                      ? contains(p_world_m[i])
                      : verdicts[i - begin] == InHull::yes &&
                            hull_->rule().within_world_m.contains(p_world_m[i]);
  });
}

}  // namespace fivepipe::hull
