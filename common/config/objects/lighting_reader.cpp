#include "common/config/objects/lighting_reader.h"

#include <fmt/format.h>
#include <cmath>

#include "common/config/yaml/numbers.h"

namespace fivepipe::config {
namespace {

constexpr Range kFov_deg{1, 150};
constexpr Range kClip_m{1e-3, 1e3};
constexpr Range kMap_px{16, 8192};
constexpr int kMinHull_px = 16, kMaxHull_px = 4096;

}  // namespace

ShadowView read_shadows(YamlMap map, const Eigen::Vector3d& light_world_m) {
  const std::size_t problems_before = map.problem_count();
  ShadowView shadows;
  shadows.target_world_m = map.vector3("target_m", kAny);
  shadows.fov_rad = kDegree_rad * map.number("fov_deg", kFov_deg);
  shadows.near_m = map.number("near_m", kClip_m, shadows.near_m);
  shadows.far_m = map.number("far_m", kClip_m, shadows.far_m);
  shadows.map_px = map.integer("map_px", kMap_px, shadows.map_px);
  shadows.hull_size_px = map.size_px("hull_size_px", shadows.hull_size_px);
  map.finish();
  if (map.problem_count() > problems_before) return shadows;
  for (const int size_px : shadows.hull_size_px)
    if (size_px < kMinHull_px || size_px > kMaxHull_px)
      map.problem_at("hull_size_px", fmt::format("hull_size_px must be {} to {}, is {}",
                                                 kMinHull_px, kMaxHull_px, size_px));
  if (!(shadows.near_m < shadows.far_m))
    map.problem_at("far_m", fmt::format("far_m must be greater than near_m ({}), is {}",
                                        shadows.near_m, shadows.far_m));
  // Its square may underflow or overflow.
  if (const double distance_m = (shadows.target_world_m - light_world_m).norm();
      !(distance_m > 0 && std::isfinite(distance_m)))
    map.problem_at("target_m", fmt::format("target_m is {} the light: the light has no direction",
                                           distance_m > 0 ? "too far from" : "at"));
  return shadows;
}

}  // namespace fivepipe::config
