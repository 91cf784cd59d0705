#include "common/hull/cpu/has_hull.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::hull {
namespace {

constexpr int kStep_px = 4;
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
  if (silhouettes.empty() || hull.empty()) return false;
  // A camera without object pixels sees nothing; with Limits::seen, the others may have a hull.
  const Silhouette* from = nullptr;
  std::size_t fewest = 0;
  for (const Silhouette& one : silhouettes)
    if (const std::size_t count = one.pixels.count();
        count > 0 && (from == nullptr || count < fewest)) {
      from = &one;
      fewest = count;
    }
  if (from == nullptr) return false;
  const geometry::Pinhole& whole = from->camera.pinhole;
  View view{{geometry::resized(whole, std::max(1, whole.width_px / kStep_px),
                               std::max(1, whole.height_px / kStep_px)),
             from->camera.camera_from_world},
            kNear_m,
            farthest_m(from->camera, hull.rule())};
  const PixelRect all{0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px};
  const DepthTile depths = hull.depth(view, all);
  return std::any_of(depths.depth_m.begin(), depths.depth_m.end(),
                     [](float depth_m) { return depth_m != kNoHull; });
}

}  // namespace fivepipe::hull
