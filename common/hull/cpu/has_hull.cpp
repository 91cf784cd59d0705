#include "common/hull/cpu/has_hull.h"

#include <algorithm>
#include <cassert>

namespace fivepipe::hull {
namespace {

constexpr double kNear_m = 1e-3;
// Of a hull without a bounded volume.
constexpr double kFar_m = 1e3;

double farthest_m(const geometry::Camera& camera, const HullRule& rule) {
  if (!rule.within_world_m.min().allFinite() || !rule.within_world_m.max().allFinite())
    return kFar_m;
  double farthest = 2 * kNear_m;
  for (int corner = 0; corner < 8; ++corner)
    farthest =
        std::max(farthest, (camera.camera_from_world *
                            rule.within_world_m.corner(Eigen::AlignedBox3d::CornerType(corner)))
                               .z());
  return farthest;
}

}  // namespace

bool has_hull(CpuHull& hull, std::span<const Silhouette> silhouettes) {
  assert(hull.rule().limits == Limits::all);
  if (silhouettes.empty() || hull.empty()) return false;
  const Silhouette& from = *std::min_element(
      silhouettes.begin(), silhouettes.end(),
      [](const Silhouette& a, const Silhouette& b) { return a.pixels.count() < b.pixels.count(); });
  const View view{from.camera, kNear_m, farthest_m(from.camera, hull.rule())};
  const DepthTile depths = hull.depth(view, from.pixels.bounds());
  return std::any_of(depths.depth_m.begin(), depths.depth_m.end(),
                     [](float depth_m) { return depth_m != kNoHull; });
}

}  // namespace fivepipe::hull
