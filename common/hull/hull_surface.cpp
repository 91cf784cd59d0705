#include "common/hull/hull_surface.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "common/hull/contour.h"
#include "common/hull/map_from_view.h"
#include "common/hull/ray_walk.h"

namespace fivepipe {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;
using Eigen::Vector3f;

// How far a tile's depth may be from the exact one, as a fraction: twice what CpuHull::depth promises.
constexpr double kDepthError = 4e-6;

struct Limit {
  double t;
  int camera = kNearPlane;  // of hull.cameras()
  Kept kept = Kept::object;
};

// Where a ray enters the hull, and through whose border: who moved it on last. As RayWalk::next_entry.
std::optional<Limit> first_limit(std::vector<MapWalk>& walks, const HullRule& rule, double t, double end) {
  Limit limit{t};
  bool was_empty = false;
  for (;;) {
    if (!(limit.t < end)) return std::nullopt;
    int seen = 0, next = -1;
    double until = kNever;
    was_empty = false;
    for (int i = 0; i < int(walks.size()); ++i) {
      const Held held = walks[std::size_t(i)].held(limit.t);
      if (held.verdict == Verdict::object) ++seen;
      else if (held.verdict == Verdict::empty || held.until < until) next = i, until = held.until, was_empty = held.verdict == Verdict::empty;
      if (was_empty) break;
    }
    if (!was_empty && seen >= (rule.limits == Limits::all ? int(walks.size()) : rule.min_seen)) return limit;
    if (next < 0) return std::nullopt;
    limit = {until, next};
    const bool lets_go = was_empty && until < end && walks[std::size_t(next)].held(until).verdict == Verdict::unseen;
    limit.kept = lets_go ? Kept::not_empty : Kept::object;
  }
}

struct Edge {
  Vector2i pixel, outward;
};

double squared_distance(const Vector2d& uv_px, const Edge& edge) {
  const Vector2d d = uv_px - edge.pixel.cast<double>() - 0.5 * edge.outward.cast<double>();
  const double across = d.dot(edge.outward.cast<double>()), along = std::max(0.0, std::abs(d.x() * edge.outward.y() - d.y() * edge.outward.x()) - 0.5);
  return across * across + along * along;
}

// The contour's edge at uv, through which an image that moves along `motion` comes in.
std::optional<Edge> edge_at(const ContourMap& map, const Vector2d& uv_px, const Vector2d& motion) {
  const Vector2i middle(int(std::floor(uv_px.x() + 0.5)), int(std::floor(uv_px.y() + 0.5)));
  std::optional<Edge> nearest;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du) {
      const Vector2i pixel = middle + Vector2i(du, dv);
      if (!map.keeps(pixel.x(), pixel.y())) continue;
      for (const Vector2i& outward : {Vector2i(-1, 0), Vector2i(1, 0), Vector2i(0, -1), Vector2i(0, 1)}) {
        const Edge edge{pixel, outward};
        if (outward.cast<double>().dot(motion) > 0 || map.keeps(pixel.x() + outward.x(), pixel.y() + outward.y())) continue;
        if (!nearest || squared_distance(uv_px, edge) < squared_distance(uv_px, *nearest)) nearest = edge;
      }
    }
  return nearest;
}

// Normal of the plane through a camera's centre and the tangent at uv whose normal in the image is `outward`. It is the gradient, in
// world coordinates, of outward . (pixel of p - uv) times the depth of p.
Vector3d plane_normal(const Camera& camera, const Vector2d& uv_px, const Vector2d& outward) {
  const Pinhole& k = camera.pinhole;
  const Vector3d of_camera(outward.x() * k.fx_px, outward.y() * k.fy_px, -(outward.x() * (uv_px.x() - k.cx_px) + outward.y() * (uv_px.y() - k.cy_px)));
  return (camera.camera_from_world.linear().transpose() * of_camera).normalized();
}

class Surface {
 public:
  Surface(const HullQuery& query, const View& view) : hull_(query.hull()), view_(view) {
    for (const CpuHull::MapCamera& c : hull_.cameras()) maps_.push_back(map_from_view(c.camera, view.camera));
  }

  void at(int u, int v, float depth_m, int& camera, Vector3f& normal) const {
    camera = kNoSurface;
    normal.setZero();
    if (!(depth_m > 0)) return;
    const Ray ray = ray_through(view_.camera, Vector2d(u, v));
    // From just before the depth; where that is wrong, from the near plane.
    auto limit = first_limit(u, v, std::max(view_.near_m, depth_m * (1 - kDepthError)), std::min(view_.far_m, depth_m * (1 + kDepthError)));
    if (!limit || (limit->camera == kNearPlane && limit->t > view_.near_m)) limit = first_limit(u, v, view_.near_m, view_.far_m);
    if (!limit) return;
    if (limit->camera == kNearPlane) {
      camera = kNearPlane;
      normal = -view_.camera.camera_from_world.linear().row(2).transpose().normalized().cast<float>();
      return;
    }
    const auto outward = normal_at(*limit, u, v, ray.direction_world);
    if (!outward) return;
    camera = hull_.cameras()[std::size_t(limit->camera)].silhouette;
    normal = outward->cast<float>();
  }

 private:
  std::optional<Limit> first_limit(int u, int v, double begin, double end) const {
    std::vector<MapWalk> walks;
    walks.reserve(maps_.size());
    for (std::size_t i = 0; i < maps_.size(); ++i) {
      const CpuHull::MapCamera& c = hull_.cameras()[i];
      walks.emplace_back(image_line(maps_[i], u, v), c.reach, walk_window(c.camera, c.reach, hull_.rule()), beyond_window(hull_.rule()), RayRange{begin, end});
    }
    return fivepipe::first_limit(walks, hull_.rule(), begin, end);
  }

  std::optional<Vector3d> normal_at(const Limit& limit, int u, int v, const Vector3d& direction_world) const {
    const CpuHull::MapCamera& c = hull_.cameras()[std::size_t(limit.camera)];
    const ImageLine l = image_line(maps_[std::size_t(limit.camera)], u, v);
    const double w = l.w_offset + limit.t * l.w_slope;
    const Vector2d uv((l.u_offset + limit.t * l.u_slope) / w - 0.5, (l.v_offset + limit.t * l.v_slope) / w - 0.5);
    const Vector2d motion(l.u_slope * l.w_offset - l.u_offset * l.w_slope, l.v_slope * l.w_offset - l.v_offset * l.w_slope);
    const PixelRect image = image_of(c.camera);
    if (!holds({-1, -1, image.u1_px + 1, image.v1_px + 1}, uv.x(), uv.y())) return std::nullopt;  // and where it is not a number
    const ContourMap map{&c.reach, image, limit.kept};
    const auto edge = edge_at(map, uv, motion);
    if (!edge) return std::nullopt;
    Vector3d normal = plane_normal(c.camera, uv, contour_normal(map, edge->pixel.x(), edge->pixel.y(), edge->outward.x(), edge->outward.y(), uv));
    // A smoothed contour may turn from the eye where the staircase did not: there the surface is seen edge-on.
    const Vector3d d = direction_world.normalized();
    if (const double away = normal.dot(d); away > 0) normal = (normal - away * d).normalized();
    return normal;
  }

  const CpuHull& hull_;
  const View& view_;
  std::vector<MapFromView> maps_;
};

}  // namespace

HullSurface hull_surface(const HullQuery& query, const View& view, const DepthTile& tile) {
  assert(tile.depth_m.size() == tile.rect.area_px());
  HullSurface result{tile.rect, std::vector<int>(tile.depth_m.size(), kNoSurface), std::vector<Eigen::Vector3f>(tile.depth_m.size(), Eigen::Vector3f::Zero())};
  if (query.hull().empty() || !is_finite(view.camera) || !(view.near_m > 0 && view.near_m < view.far_m && std::isfinite(view.far_m))) return result;
  const Surface surface(query, view);
  query.hull().pool().run(tile.rect.height_px(), [&](int row, int) {
    for (int column = 0; column < tile.rect.width_px(); ++column) {
      const std::size_t i = std::size_t(row) * std::size_t(tile.rect.width_px()) + std::size_t(column);
      surface.at(tile.rect.u0_px + column, tile.rect.v0_px + row, tile.depth_m[i], result.limiting_camera[i], result.normal_world[i]);
    }
  });
  return result;
}

}  // namespace fivepipe
