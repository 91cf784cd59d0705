#include "common/geometry/box_visibility.h"

#include <array>
#include <vector>

namespace fivepipe::geometry {

namespace {

using Polygon = std::vector<Eigen::Vector3d>;

// Returns the part of a polygon with normal . p >= 0.
Polygon clipped(const Polygon& polygon, const Eigen::Vector3d& normal) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = normal.dot(a), at_b = normal.dot(b);
    if (at_a >= 0) result.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) result.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return result;
}

// Returns the inward normals, in the camera frame, of the planes through the camera's centre and
// the edges of its image.
std::array<Eigen::Vector3d, 4> pyramid_of(const Pinhole& k) {
  const double left = (-0.5 - k.cx_px) / k.fx_px, right = (k.width_px - 0.5 - k.cx_px) / k.fx_px;
  const double top = (-0.5 - k.cy_px) / k.fy_px, bottom = (k.height_px - 0.5 - k.cy_px) / k.fy_px;
  return {Eigen::Vector3d(1, 0, -left), {-1, 0, right}, {0, 1, -top}, {0, -1, bottom}};
}

}  // namespace

bool is_box_visible(const Camera& camera, const Eigen::AlignedBox3d& box_world_m) {
  // The pyramid is unbounded: if it intersects the box, it also intersects a face of the box, even
  // if the camera is inside. So the six faces suffice.
  const auto pyramid = pyramid_of(camera.pinhole);
  const Eigen::Vector3d &min = box_world_m.min(), &max = box_world_m.max();
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const Eigen::Vector3d& end : {min, max}) {
      Polygon face;
      for (const auto& [max_u, max_v] :
           {std::pair{false, false}, {true, false}, {true, true}, {false, true}}) {
        Eigen::Vector3d corner = end;
        corner[u] = (max_u ? max : min)[u];
        corner[v] = (max_v ? max : min)[v];
        face.push_back(camera.camera_from_world * corner);
      }
      for (const Eigen::Vector3d& normal : pyramid) face = clipped(face, normal);
      if (!face.empty()) return true;
    }
  }
  return false;
}

}  // namespace fivepipe::geometry
