#include "common/hull/silhouette_bounds.h"

#include <array>

namespace fivepipe::hull {
namespace {

using Vector3d = Eigen::Vector3d;
using Plane = Eigen::Hyperplane<double, 3>;  // the side with signedDistance >= 0 is inside

void add_planes(std::vector<Plane>& planes, const SilhouetteBounds& seen, double nearest_m) {
  constexpr double kRectMargin_px = 0.01;
  const geometry::Pinhole& k = seen.camera.pinhole;
  const double left = seen.part.u0_px - 0.5 - kRectMargin_px,
               right = seen.part.u1_px - 0.5 + kRectMargin_px,
               top = seen.part.v0_px - 0.5 - kRectMargin_px,
               bottom = seen.part.v1_px - 0.5 + kRectMargin_px;
  // The first normal is that of fx x / z + cx >= left, multiplied by z; the others are alike.
  const std::array<Vector3d, 4> normals_camera = {
      Vector3d(k.fx_px, 0, k.cx_px - left), Vector3d(-k.fx_px, 0, right - k.cx_px),
      Vector3d(0, k.fy_px, k.cy_px - top), Vector3d(0, -k.fy_px, bottom - k.cy_px)};
  const Vector3d center_world_m = geometry::camera_center_world_m(seen.camera);
  for (const Vector3d& normal : normals_camera)
    planes.emplace_back((seen.camera.camera_from_world.linear().transpose() * normal).normalized(),
                        center_world_m);
  const Vector3d forward = seen.camera.camera_from_world.linear().row(2);
  planes.emplace_back(forward, Vector3d(center_world_m + nearest_m * forward));
}

// Returns the part of a convex polygon inside the plane (Sutherland and Hodgman, 1974).
std::vector<Vector3d> clipped(const std::vector<Vector3d>& polygon, const Plane& plane) {
  std::vector<Vector3d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = plane.signedDistance(a), at_b = plane.signedDistance(b);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a < 0) != (at_b < 0)) kept.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return kept;
}

}  // namespace

// Each plane can hold one face of the body: a square in that plane, larger than the box, clipped by
// all other planes.
std::vector<Vector3d> corners_around_hull(std::span<const SilhouetteBounds> parts,
                                          const Eigen::AlignedBox3d& box_m, double nearest_m) {
  std::vector<Plane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    planes.emplace_back(Vector3d::Unit(axis), box_m.min());
    planes.emplace_back(-Vector3d::Unit(axis), box_m.max());
  }
  for (const SilhouetteBounds& seen : parts) add_planes(planes, seen, nearest_m);
  const double size_m = box_m.diagonal().norm();
  std::vector<Vector3d> corners;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const Vector3d center = planes[i].projection(box_m.center());
    const Vector3d along = size_m * planes[i].normal().unitOrthogonal(),
                   across = planes[i].normal().cross(along);
    std::vector<Vector3d> face = {center + along, center + across, center - along, center - across};
    for (std::size_t j = 0; j < planes.size() && !face.empty(); ++j)
      if (j != i) face = clipped(face, planes[j]);
    corners.insert(corners.end(), face.begin(), face.end());
  }
  return corners;
}

}  // namespace fivepipe::hull
