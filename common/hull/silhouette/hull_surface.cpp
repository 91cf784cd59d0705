#include "common/hull/silhouette/hull_surface.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/hull/map_from_view.h"
#include "common/hull/silhouette/hull_border.h"

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

// Relative error allowed for a tile's depth: twice the bound of CpuHull::depth().
constexpr double kDepthError = 4e-6;

class Surface {
 public:
  Surface(const HullQuery& query, const View& view) : hull_(query.hull()), view_(view) {
    for (const CpuHull::MapCamera& c : hull_.cameras())
      maps_.push_back(map_from_view(c.camera, view.camera));
  }

  void at(int u, int v, float depth_m, int& camera, Vector3f& normal) const {
    camera = kNoSurface;
    normal.setZero();
    if (!(depth_m > 0)) return;
    std::vector<ImageLine> lines;
    lines.reserve(maps_.size());
    for (const MapFromView& map : maps_) lines.push_back(image_line(map, u, v));
    // Start just before the depth; if that finds no border, start at the near plane or where the
    // ray enters the rule's box.
    const RayRange range = range_in_box(hull_.rule().within_world_m,
                                        geometry::ray_through(view_.camera, Vector2d(u, v)),
                                        {view_.near_m, view_.far_m});
    auto border = first_border(hull_, lines, std::max(range.begin, depth_m * (1 - kDepthError)),
                               std::min(range.end, depth_m * (1 + kDepthError)));
    if (!border || (border->camera < 0 && border->t > range.begin))
      border = first_border(hull_, lines, range.begin, range.end);
    if (!border) return;
    if (border->camera < 0) {
      camera = kNearPlane;
      normal =
          -view_.camera.camera_from_world.linear().row(2).transpose().normalized().cast<float>();
      return;
    }
    const auto outward = normal_at(hull_, *border, lines[std::size_t(border->camera)]);
    if (!outward) return;
    camera = hull_.cameras()[std::size_t(border->camera)].silhouette;
    // A smoothed contour may face away from the eye even if the staircase does not. The surface is
    // then seen edge-on.
    const Vector3d d =
        geometry::ray_through(view_.camera, Vector2d(u, v)).direction_world.normalized();
    const double away = outward->normal_world.dot(d);
    normal = (away > 0 ? (outward->normal_world - away * d).normalized() : outward->normal_world)
                 .cast<float>();
  }

 private:
  const CpuHull& hull_;
  const View& view_;
  std::vector<MapFromView> maps_;
};

}  // namespace

HullSurface hull_surface(const HullQuery& query, const View& view, const DepthTile& tile) {
  assert(tile.depth_m.size() == tile.rect.area_px());
  HullSurface result{tile.rect, std::vector<int>(tile.depth_m.size(), kNoSurface),
                     std::vector<Eigen::Vector3f>(tile.depth_m.size(), Eigen::Vector3f::Zero())};
  if (query.hull().empty() || !is_finite(view.camera) ||
      !(view.near_m > 0 && view.near_m < view.far_m && std::isfinite(view.far_m)))
    return result;
  const Surface surface(query, view);
  query.hull().pool().run(tile.rect.height_px(), [&](int row, int) {
    for (int column = 0; column < tile.rect.width_px(); ++column) {
      const std::size_t i =
          std::size_t(row) * std::size_t(tile.rect.width_px()) + std::size_t(column);
      surface.at(tile.rect.u0_px + column, tile.rect.v0_px + row, tile.depth_m[i],
                 result.limiting_camera[i], result.normal_world[i]);
    }
  });
  return result;
}

}  // namespace fivepipe::hull
