#include "common/collision/detection/triangle.h"

#include <algorithm>

namespace fivepipe::collision {

std::vector<Triangle> world_triangles(const geometry::Mesh& mesh,
                                      const Eigen::Isometry3d& world_from_object) {
  std::vector<Eigen::Vector3d> vertices_world_m;
  vertices_world_m.reserve(mesh.vertices_m.size());
  for (const Eigen::Vector3d& v : mesh.vertices_m)
    vertices_world_m.push_back(world_from_object * v);
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back({vertices_world_m[a], vertices_world_m[b], vertices_world_m[c]});
  return triangles;
}

TriangleView view_of(const Triangle& triangle) {
  Triangle v = triangle;
  std::sort(v.begin(), v.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  const std::array<double, 3> opposite_edge_sq = {
      (v[2] - v[1]).squaredNorm(), (v[2] - v[0]).squaredNorm(), (v[1] - v[0]).squaredNorm()};
  const std::size_t apex =
      std::size_t(std::max_element(opposite_edge_sq.begin(), opposite_edge_sq.end()) -
                  opposite_edge_sq.begin());
  TriangleView view{v[apex == 0 ? 1 : 0], v[apex == 2 ? 1 : 2], v[apex]};
  const Eigen::Vector3d base = view.base1_world_m - view.base0_world_m,
                        side = view.apex_world_m - view.base0_world_m;
  const double base_sq = base.squaredNorm();
  if (base_sq > 0) view.apex_x = std::clamp(base.dot(side) / base_sq, 0.0, 1.0);
  view.degenerate = !(base.cross(side).norm() > kDegenerateHeight * base_sq);
  return view;
}

Eigen::Vector3d point_at(const TriangleView& view, double x, double y) {
  const double apex = std::clamp(y, 0.0, 1.0);
  const double base1 = std::clamp(x - apex * view.apex_x, 0.0, 1.0 - apex);
  return view.base0_world_m + base1 * (view.base1_world_m - view.base0_world_m) +
         apex * (view.apex_world_m - view.base0_world_m);
}

}  // namespace fivepipe::collision
