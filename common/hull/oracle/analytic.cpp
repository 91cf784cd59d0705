// A ray enters a capsule through the side of its cylinder or through one of its two spheres. The
// touched pixels follow from distances of convex bodies (Ericson, Real-Time Collision Detection,
// 5.1.9: closest points of two segments).
#include "common/hull/oracle/analytic.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fivepipe::hull {
namespace {

using Eigen::Vector3d;

// Bound of rounding of the distances below, as a fraction of the coordinates. The radius grows by
// it, so that the touched pixels certainly contain the object.
constexpr double kRoundingFraction = 1e-12;

double squared_distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double s = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - s * ab).squaredNorm();
}

// Returns the parameter at which the ray enters a ball. The ray's origin is not in the ball.
std::optional<double> ball_entry(const Vector3d& centre, double radius, const geometry::Ray& ray) {
  const Vector3d m = ray.origin_world_m - centre;
  const double dd = ray.direction_world.squaredNorm(), md = m.dot(ray.direction_world);
  // The discriminant uses the closest point of the line, so nothing cancels for distant balls.
  const double h2 = radius * radius - (m - md / dd * ray.direction_world).squaredNorm();
  if (!(h2 >= 0)) return std::nullopt;
  const double t = (-md - std::sqrt(h2 * dd)) / dd;
  return t >= 0 ? std::optional(t) : std::nullopt;
}

// Returns the parameter at which the ray enters the cylinder through its side.
std::optional<double> side_entry(const Capsule& c, const geometry::Ray& ray) {
  const Vector3d axis = c.b_world_m - c.a_world_m;
  const double length2 = axis.squaredNorm();
  if (!(length2 > 0)) return std::nullopt;
  const Vector3d m = ray.origin_world_m - c.a_world_m;
  const Vector3d d_across = ray.direction_world - ray.direction_world.dot(axis) / length2 * axis;
  const Vector3d m_across = m - m.dot(axis) / length2 * axis;
  const double dd = d_across.squaredNorm(), md = m_across.dot(d_across);
  if (!(dd > 0)) return std::nullopt;  // parallel to the axis: the ray enters through a ball
  const double h2 = c.radius_m * c.radius_m - (m_across - md / dd * d_across).squaredNorm();
  if (!(h2 >= 0)) return std::nullopt;
  const double t = (-md - std::sqrt(h2 * dd)) / dd;
  const double along = (m + t * ray.direction_world).dot(axis);
  return t >= 0 && along >= 0 && along <= length2 ? std::optional(t) : std::nullopt;
}

// Returns the squared distance between segment a-b and the half-line from the origin along unit
// direction e.
double squared_distance_to_half_line(const Vector3d& a, const Vector3d& b, const Vector3d& e) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm(), along = ab.dot(e), across2 = length2 - along * along;
  // Find the closest points of the two lines, clamp each parameter and solve for the other again.
  double s = across2 > 0 ? std::clamp((a.dot(e) * along - a.dot(ab)) / across2, 0.0, 1.0) : 0.0;
  double t = (a + s * ab).dot(e);
  if (t < 0) {
    t = 0;
    s = length2 > 0 ? std::clamp(-a.dot(ab) / length2, 0.0, 1.0) : 0.0;
  }
  return (a + s * ab - t * e).squaredNorm();
}

// The convex cone of all lines of sight through a rectangle of the image, in the camera frame. Its
// apex is the camera's centre.
struct ViewCone {
  std::array<Vector3d, 4> edges;            // unit, in the order of the rectangle's corners
  std::array<Vector3d, 4> outward_normals;  // unit; [i] of the face between edges i and i + 1
};

ViewCone view_cone(const geometry::Pinhole& k, double u0_px, double v0_px, double u1_px,
                   double v1_px) {
  const auto direction = [&](double u_px, double v_px) {
    return Vector3d((u_px - k.cx_px) / k.fx_px, (v_px - k.cy_px) / k.fy_px, 1.0).normalized();
  };
  ViewCone cone;
  cone.edges = {direction(u0_px, v0_px), direction(u1_px, v0_px), direction(u1_px, v1_px),
                direction(u0_px, v1_px)};
  for (int i = 0; i < 4; ++i)
    cone.outward_normals[i] = cone.edges[(i + 1) % 4].cross(cone.edges[i]).normalized();
  return cone;
}

bool segment_meets(const ViewCone& cone, const Vector3d& a, const Vector3d& b) {
  double s0 = 0, s1 = 1;
  for (const Vector3d& n : cone.outward_normals) {
    const double da = n.dot(a), db = n.dot(b);
    if (da > 0 && db > 0) return false;
    if (da > 0) s0 = std::max(s0, da / (da - db));
    if (db > 0) s1 = std::min(s1, da / (da - db));
  }
  return s0 <= s1;
}

// Returns true if the perpendicular from p meets the interior of a face at most `radius` away.
bool near_face(const ViewCone& cone, const Vector3d& p, double radius) {
  for (int i = 0; i < 4; ++i) {
    const Vector3d& n = cone.outward_normals[i];
    const double distance = n.dot(p);
    if (!(distance >= 0 && distance <= radius)) continue;
    const Vector3d foot = p - distance * n;
    if (cone.edges[i].cross(foot).dot(n) <= 0 && foot.cross(cone.edges[(i + 1) % 4]).dot(n) <= 0)
      return true;
  }
  return false;
}

enum class Overlap { none, some, all };

// Overlap of a rectangle's view cone with the capsule (camera frame). The silhouette of a convex
// body is convex, so it holds the rectangle if it holds its four corners. The nearest points of two
// convex polyhedra are on two edges or on a corner and a face.
Overlap overlap(const ViewCone& cone, const Vector3d& a, const Vector3d& b, double radius) {
  for (const Vector3d& n : cone.outward_normals)
    if (n.dot(a) > radius && n.dot(b) > radius) return Overlap::none;
  int corners = 0;
  for (const Vector3d& e : cone.edges)
    corners += squared_distance_to_half_line(a, b, e) <= radius * radius;
  if (corners == 4) return Overlap::all;
  if (corners > 0 || segment_meets(cone, a, b) || near_face(cone, a, radius) ||
      near_face(cone, b, radius))
    return Overlap::some;
  return Overlap::none;
}

// Sets the pixels of one capsule's silhouette: halves rectangles until each is inside, outside or a
// single pixel.
struct Painter {
  ObjectPixels& pixels;
  const geometry::Pinhole& pinhole;
  PixelRule rule;
  Vector3d a, b;  // camera frame [m]
  double radius;

  bool center_is_in(int u, int v) const {
    const Vector3d sight((u - pinhole.cx_px) / pinhole.fx_px, (v - pinhole.cy_px) / pinhole.fy_px,
                         1.0);
    return squared_distance_to_half_line(a, b, sight.normalized()) <= radius * radius;
  }

  void fill(const PixelRect& r) const {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) pixels.set(u, v);
  }

  void paint(const PixelRect& r) const {
    const ViewCone cone =
        view_cone(pinhole, r.u0_px - 0.5, r.v0_px - 0.5, r.u1_px - 0.5, r.v1_px - 0.5);
    switch (overlap(cone, a, b, radius + kRoundingFraction * (a.norm() + b.norm() + radius))) {
      case Overlap::none: return;
      case Overlap::all: return fill(r);
      case Overlap::some:
        if (r.area_px() > 1) return split(r);
        if (rule == PixelRule::touched || center_is_in(r.u0_px, r.v0_px))
          pixels.set(r.u0_px, r.v0_px);
    }
  }

  void split(const PixelRect& r) const {
    if (r.width_px() >= r.height_px()) {
      const int u = (r.u0_px + r.u1_px) / 2;
      paint({r.u0_px, r.v0_px, u, r.v1_px});
      paint({u, r.v0_px, r.u1_px, r.v1_px});
    } else {
      const int v = (r.v0_px + r.v1_px) / 2;
      paint({r.u0_px, r.v0_px, r.u1_px, v});
      paint({r.u0_px, v, r.u1_px, r.v1_px});
    }
  }
};

}  // namespace

std::optional<double> ray_entry(const Capsule& capsule, const geometry::Ray& ray) {
  if (squared_distance_to_segment(ray.origin_world_m, capsule.a_world_m, capsule.b_world_m) <=
      capsule.radius_m * capsule.radius_m)
    return 0.0;
  std::optional<double> first;
  for (const auto& t :
       {side_entry(capsule, ray), ball_entry(capsule.a_world_m, capsule.radius_m, ray),
        ball_entry(capsule.b_world_m, capsule.radius_m, ray)})
    if (t && !(first && *first <= *t)) first = t;
  return first;
}

bool in_silhouette(std::span<const Capsule> object, const geometry::Camera& camera,
                   const Eigen::Vector2d& uv_px) {
  const geometry::Ray ray = geometry::ray_through(camera, uv_px);
  return std::any_of(object.begin(), object.end(),
                     [&](const Capsule& c) { return ray_entry(c, ray).has_value(); });
}

bool in_analytic_hull(std::span<const Capsule> object, std::span<const geometry::Camera> cameras,
                      const Eigen::Vector3d& p_world_m) {
  for (const geometry::Camera& camera : cameras) {
    const auto uv = geometry::project(camera, p_world_m);
    const geometry::Pinhole& k = camera.pinhole;
    if (!uv || !(uv->x() >= -0.5 && uv->y() >= -0.5 && uv->x() < k.width_px - 0.5 &&
                 uv->y() < k.height_px - 0.5))
      return false;
    if (!in_silhouette(object, camera, *uv)) return false;
  }
  return !cameras.empty();
}

ObjectPixels true_object_pixels(std::span<const Capsule> object, const geometry::Camera& camera,
                                PixelRule rule) {
  const geometry::Pinhole& k = camera.pinhole;
  ObjectPixels pixels(k.width_px, k.height_px);
  if (k.width_px == 0 || k.height_px == 0) return pixels;
  for (const Capsule& c : object)
    Painter{pixels,
            k,
            rule,
            camera.camera_from_world * c.a_world_m,
            camera.camera_from_world * c.b_world_m,
            c.radius_m}
        .paint({0, 0, k.width_px, k.height_px});
  return pixels;
}

ObjectPixels true_object_pixels(const geometry::OrientedBox& box, const geometry::Camera& camera) {
  ObjectPixels pixels(camera.pinhole.width_px, camera.pinhole.height_px);
  for (int v = 0; v < pixels.height_px(); ++v)
    for (int u = 0; u < pixels.width_px(); ++u)
      if (geometry::ray_entry(box, geometry::ray_through(camera, {double(u), double(v)})))
        pixels.set(u, v);
  return pixels;
}

}  // namespace fivepipe::hull
