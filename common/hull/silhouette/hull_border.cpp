#include "common/hull/silhouette/hull_border.h"

#include <algorithm>
#include <cmath>

#include "common/hull/silhouette/border_plane.h"

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;

double squared_distance(const Vector2d& uv_px, const ContourEdge& edge) {
  const Vector2d d = uv_px - edge.pixel.cast<double>() - 0.5 * edge.outward.cast<double>();
  const double across = d.dot(edge.outward.cast<double>()),
               along = std::max(
                   0.0, std::abs(d.x() * edge.outward.y() - d.y() * edge.outward.x()) - 0.5);
  return across * across + along * along;
}

// Returns the contour's edge nearest to uv, among the edges of pixels within reach_px of uv's pixel
// that an image moving along `motion` enters through, or among all edges if `motion` is zero.
std::optional<ContourEdge> edge_at(const ContourMap& map, const Vector2d& uv_px,
                                   const Vector2d& motion, int reach_px = 1) {
  const Vector2i center(int(std::floor(uv_px.x() + 0.5)), int(std::floor(uv_px.y() + 0.5)));
  std::optional<ContourEdge> nearest;
  for (int dv = -reach_px; dv <= reach_px; ++dv)
    for (int du = -reach_px; du <= reach_px; ++du) {
      const Vector2i pixel = center + Vector2i(du, dv);
      if (!map.keeps(pixel.x(), pixel.y())) continue;
      for (const Vector2i& outward :
           {Vector2i(-1, 0), Vector2i(1, 0), Vector2i(0, -1), Vector2i(0, 1)}) {
        const ContourEdge edge{pixel, outward};
        if (outward.cast<double>().dot(motion) > 0 ||
            map.keeps(pixel.x() + outward.x(), pixel.y() + outward.y()))
          continue;
        if (!nearest || squared_distance(uv_px, edge) < squared_distance(uv_px, *nearest))
          nearest = edge;
      }
    }
  return nearest;
}

BorderNormal normal_of(const geometry::Camera& camera, const ContourMap& map,
                       const ContourEdge& edge, const Vector2d& uv_px) {
  const ContourFit fit = contour_fit(map, edge, uv_px);
  return {plane_normal(camera, uv_px, fit.normal), fit.error_rad};
}

bool in_or_beside(const PixelRect& image,
                  const Vector2d& uv_px) {  // false for NaN
  return holds({-1, -1, image.u1_px + 1, image.v1_px + 1}, uv_px.x(), uv_px.y());
}

// Returns a camera if its border passes the point within kAtBorder_px, so that it also limits the
// hull there.
std::optional<LimitingCamera> also_limits(const CpuHull& hull, const CpuHull::MapCamera& c,
                                          const Vector3d& p_world_m) {
  const auto uv_px = geometry::project(c.camera, p_world_m);
  const PixelRect image = image_of(c.camera);
  if (!uv_px || !in_or_beside(image, *uv_px)) return std::nullopt;
  // With Limits::seen a point that leaves the image on an object pixel may stay in the hull.
  const ContourMap map{&c.skip_map, image,
                       hull.rule().limits == Limits::seen ? Kept::not_empty : Kept::object};
  const auto edge = edge_at(map, *uv_px, Vector2d::Zero());
  if (!edge) return std::nullopt;
  const double distance_px = std::sqrt(squared_distance(*uv_px, *edge));
  if (!(distance_px <= kAtBorder_px)) return std::nullopt;
  const BorderNormal found = normal_of(c.camera, map, *edge, *uv_px);
  return LimitingCamera{c.silhouette, found.normal_world, found.error_rad, distance_px};
}

}  // namespace

// Works as RayWalk::next_entry() does, but records the camera that moved the ray on last.
std::optional<RayBorder> first_border(const CpuHull& hull, std::span<const ImageLine> lines,
                                      double near, double far) {
  const HullRule& rule = hull.rule();
  std::vector<MapWalk> walks;
  walks.reserve(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const CpuHull::MapCamera& c = hull.cameras()[i];
    walks.emplace_back(lines[i], c.skip_map, walk_window(c.camera, c.skip_map, rule),
                       beyond_window(rule), RayRange{near, far});
  }
  RayBorder border{near};
  for (;;) {
    if (!(border.t < far)) return std::nullopt;
    int seen = 0, next = -1;
    double end = kNever;
    bool was_empty = false;
    for (int i = 0; i < int(walks.size()); ++i) {
      const VerdictSpan verdict_span = walks[std::size_t(i)].verdict_at(border.t);
      if (verdict_span.verdict == Verdict::object)
        ++seen;
      else if (verdict_span.verdict == Verdict::empty || verdict_span.end < end)
        next = i, end = verdict_span.end, was_empty = verdict_span.verdict == Verdict::empty;
      if (was_empty) break;
    }
    if (!was_empty && seen >= (rule.limits == Limits::all ? int(walks.size()) : rule.min_seen))
      return border;
    if (next < 0) return std::nullopt;
    border = {end, next};
    const bool leaves_image = was_empty && end < far &&
                              walks[std::size_t(next)].verdict_at(end).verdict == Verdict::unseen;
    border.kept = leaves_image ? Kept::not_empty : Kept::object;
  }
}

std::optional<BorderNormal> normal_at(const CpuHull& hull, const RayBorder& border,
                                      const ImageLine& l) {
  const CpuHull::MapCamera& c = hull.cameras()[std::size_t(border.camera)];
  const double w = l.w_offset + border.t * l.w_slope;
  const Vector2d uv((l.u_offset + border.t * l.u_slope) / w - 0.5,
                    (l.v_offset + border.t * l.v_slope) / w - 0.5);
  const Vector2d motion(l.u_slope * l.w_offset - l.u_offset * l.w_slope,
                        l.v_slope * l.w_offset - l.v_offset * l.w_slope);
  const PixelRect image = image_of(c.camera);
  if (!in_or_beside(image, uv)) return std::nullopt;
  const ContourMap map{&c.skip_map, image, border.kept};
  const auto edge = edge_at(map, uv, motion);
  if (!edge) return std::nullopt;
  return normal_of(c.camera, map, *edge, uv);
}

std::optional<LimitingCameras> limiting_cameras(const HullQuery& query, const geometry::Ray& ray,
                                                double near, double far) {
  const CpuHull& hull = query.hull();
  if (hull.empty() || !(near < far) || !std::isfinite(near) || !std::isfinite(far))
    return std::nullopt;
  if (!ray.origin_world_m.allFinite() || !ray.direction_world.allFinite()) return std::nullopt;
  const RayRange range = range_in_box(hull.rule().within_world_m, ray, {near, far});
  if (range.empty()) return std::nullopt;
  std::vector<ImageLine> lines;
  for (const CpuHull::MapCamera& c : hull.cameras()) lines.push_back(image_line(c.camera, ray));
  const auto border = first_border(hull, lines, range.begin, range.end);
  if (!border || border->camera < 0) return std::nullopt;
  const auto crossed = normal_at(hull, *border, lines[std::size_t(border->camera)]);
  if (!crossed) return std::nullopt;
  LimitingCameras found{border->t,
                        {{hull.cameras()[std::size_t(border->camera)].silhouette,
                          crossed->normal_world, crossed->error_rad, 0.0}}};
  for (int i = 0; i < int(hull.cameras().size()); ++i) {
    if (i == border->camera) continue;
    const auto other = also_limits(hull, hull.cameras()[std::size_t(i)],
                                   ray.origin_world_m + border->t * ray.direction_world);
    if (other) found.cameras.push_back(*other);
  }
  std::stable_sort(found.cameras.begin() + 1, found.cameras.end(),
                   [](const auto& a, const auto& b) { return a.distance_px < b.distance_px; });
  if (found.cameras.size() > kMaxLimiting)
    found.cameras.erase(found.cameras.begin() + kMaxLimiting, found.cameras.end());
  return found;
}

namespace {

int thickness_px(const ContourMap& map, const Vector2d& on_contour_px, const Vector2d& outward) {
  for (int depth_px = 1; depth_px < kMaxThickness_px; ++depth_px) {
    const Vector2d at = on_contour_px - depth_px * outward;
    if (!map.keeps(int(std::floor(at.x() + 0.5)), int(std::floor(at.y() + 0.5)))) return depth_px;
  }
  return kMaxThickness_px;
}

}  // namespace

std::vector<TangentPlane> tangent_planes(const HullQuery& query, const Vector3d& p_world_m,
                                         int reach_px) {
  std::vector<TangentPlane> planes;
  if (!p_world_m.allFinite() || reach_px < 0) return planes;
  const CpuHull& hull = query.hull();
  for (const CpuHull::MapCamera& c : hull.cameras()) {
    const auto uv_px = geometry::project(c.camera, p_world_m);
    const PixelRect image = image_of(c.camera);
    if (!uv_px || !in_or_beside(image, *uv_px)) continue;
    const ContourMap map{&c.skip_map, image,
                         hull.rule().limits == Limits::seen ? Kept::not_empty : Kept::object};
    const auto edge = edge_at(map, *uv_px, Vector2d::Zero(), reach_px);
    if (!edge) continue;
    const ContourFit fit = contour_fit(map, *edge, edge->center_px());
    const Vector3d normal = plane_normal(c.camera, fit.on_contour_px, fit.normal),
                   eye_m = c.camera.camera_from_world.inverse(Eigen::Isometry).translation();
    planes.push_back({normal, normal.dot(eye_m), fit.error_rad,
                      thickness_px(map, fit.on_contour_px, fit.normal)});
  }
  std::stable_sort(planes.begin(), planes.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.normal_world.dot(p_world_m) - a.offset_m) <
           std::abs(b.normal_world.dot(p_world_m) - b.offset_m);
  });
  if (planes.size() > kMaxTangentPlanes)
    planes.erase(planes.begin() + kMaxTangentPlanes, planes.end());
  return planes;
}

std::optional<Vector3d> nearest_in(std::span<const TangentPlane> planes,
                                   const Vector3d& p_world_m) {
  constexpr double kRounding_m = 1e-9;
  const auto holds = [&](const Vector3d& x_m) {
    return std::all_of(planes.begin(), planes.end(), [&](const TangentPlane& h) {
      return h.normal_world.dot(x_m) <= h.offset_m + kRounding_m;
    });
  };
  if (holds(p_world_m)) return p_world_m;
  std::optional<Vector3d> nearest;
  // The nearest point is the projection onto the intersection of one to three of the planes.
  const auto try_planes = [&](std::initializer_list<std::size_t> chosen) {
    const Eigen::Index count = Eigen::Index(chosen.size());
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 3, 3> normals(count, 3);
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> above(count);
    Eigen::Index row = 0;
    for (const std::size_t i : chosen) {
      normals.row(row) = planes[i].normal_world.transpose();
      above[row++] = planes[i].normal_world.dot(p_world_m) - planes[i].offset_m;
    }
    const Vector3d x_m =
        p_world_m -
        normals.transpose() *
            (normals * normals.transpose()).completeOrthogonalDecomposition().solve(above);
    if (holds(x_m) &&
        (!nearest || (x_m - p_world_m).squaredNorm() < (*nearest - p_world_m).squaredNorm()))
      nearest = x_m;
  };
  const std::size_t n = planes.size();
  for (std::size_t i = 0; i < n; ++i) {
    try_planes({i});
    for (std::size_t j = 0; j < i; ++j) {
      try_planes({i, j});
      for (std::size_t k = 0; k < j; ++k) try_planes({i, j, k});
    }
  }
  return nearest;
}

}  // namespace fivepipe::hull
