#include "common/geometry/mesh.h"

#include <cmath>
#include <map>
#include <numbers>

namespace fivepipe::geometry {

namespace {

// Appends the two faces perpendicular to `axis`, divided into the lattice of `cells`. Faces share
// the vertices on their common edges through `vertex_at`.
void append_faces(Mesh& mesh, std::map<std::array<int, 3>, std::uint32_t>& vertex_at,
                  const Eigen::Vector3d& size_m, const Eigen::Array3i& cells, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto vertex = [&](int end, int i, int j) {
    std::array<int, 3> at{};
    at[std::size_t(axis)] = end * cells[axis], at[std::size_t(u)] = i, at[std::size_t(v)] = j;
    const auto [it, is_new] = vertex_at.try_emplace(at, std::uint32_t(mesh.vertices_m.size()));
    if (is_new)
      mesh.vertices_m.push_back(size_m.cwiseProduct(
          (Eigen::Array3d(at[0], at[1], at[2]) / cells.cast<double>() - 0.5).matrix()));
    return it->second;
  };
  for (const int end : {0, 1})
    for (int i = 0; i < cells[u]; ++i)
      for (int j = 0; j < cells[v]; ++j) {
        std::uint32_t a = vertex(end, i, j), b = vertex(end, i + 1, j), c = vertex(end, i, j + 1);
        const std::uint32_t d = vertex(end, i + 1, j + 1);
        if (end == 0) std::swap(b, c);
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      }
}

}  // namespace

Mesh box_mesh(const Eigen::Vector3d& size_m, double cell_m) {
  Mesh mesh;
  if (cell_m > 0) {
    const Eigen::Array3i cells = (size_m.array() / cell_m).ceil().max(1).cast<int>();
    std::map<std::array<int, 3>, std::uint32_t> vertex_at;
    for (int axis = 0; axis < 3; ++axis) append_faces(mesh, vertex_at, size_m, cells, axis);
    return mesh;
  }
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices_m.push_back(0.5 *
                              size_m.cwiseProduct(Eigen::Vector3d(
                                  corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

namespace {

Mesh subdivided(const Mesh& coarse, double radius_m) {
  Mesh fine{coarse.vertices_m, {}};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoint_of_edge;
  const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
    const auto [it, is_new] =
        midpoint_of_edge.try_emplace(std::minmax(a, b), std::uint32_t(fine.vertices_m.size()));
    if (is_new)
      fine.vertices_m.push_back(radius_m * (fine.vertices_m[a] + fine.vertices_m[b]).normalized());
    return it->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const std::uint32_t ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
    fine.triangles.insert(fine.triangles.end(),
                          {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

}  // namespace

Mesh sphere_mesh(double radius_m, int subdivisions) {
  const double g = std::numbers::phi;
  Mesh mesh;
  for (const Eigen::Vector3d& v :
       {Eigen::Vector3d(-1, g, 0), Eigen::Vector3d(1, g, 0), Eigen::Vector3d(-1, -g, 0),
        Eigen::Vector3d(1, -g, 0), Eigen::Vector3d(0, -1, g), Eigen::Vector3d(0, 1, g),
        Eigen::Vector3d(0, -1, -g), Eigen::Vector3d(0, 1, -g), Eigen::Vector3d(g, 0, -1),
        Eigen::Vector3d(g, 0, 1), Eigen::Vector3d(-g, 0, -1), Eigen::Vector3d(-g, 0, 1)})
    mesh.vertices_m.push_back(radius_m * v.normalized());
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int i = 0; i < subdivisions; ++i) mesh = subdivided(mesh, radius_m);
  return mesh;
}

Mesh curtain_mesh(double width_m, double height_m, int columns, int rows, double fold_depth_m,
                  double fold_count) {
  Mesh mesh;
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      const double s = double(column) / columns, t = double(row) / rows;
      mesh.vertices_m.emplace_back((s - 0.5) * width_m,
                                   fold_depth_m * std::sin(2 * std::numbers::pi * fold_count * s),
                                   -t * height_m);
    }
  const auto index = [&](int row, int column) {
    return std::uint32_t(row * (columns + 1) + column);
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      mesh.triangles.push_back(
          {index(row, column), index(row + 1, column), index(row + 1, column + 1)});
      mesh.triangles.push_back(
          {index(row, column), index(row + 1, column + 1), index(row, column + 1)});
    }
  return mesh;
}

Eigen::AlignedBox3d bounds_m(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices_m) box.extend(v);
  return box;
}

}  // namespace fivepipe::geometry
