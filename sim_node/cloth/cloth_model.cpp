#include "sim_node/cloth/cloth_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <string>

namespace fivepipe::sim {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // ascending

Edge edge(std::uint32_t a, std::uint32_t b) { return std::minmax(a, b); }

// In any plane, the projection of at least one of the three axes is longer than this: the squares
// of the three lengths add up to 2.
constexpr double kMinProjection = 0.5;

// The axes of the mesh's box, longest first.
std::array<Eigen::Vector3d, 3> fibre_axes(const geometry::Mesh& mesh) {
  const Eigen::Vector3d size_m = geometry::bounds_m(mesh).sizes();
  std::array<int, 3> order = {0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size_m[a] > size_m[b]; });
  return {Eigen::Vector3d::Unit(order[0]), Eigen::Vector3d::Unit(order[1]),
          Eigen::Vector3d::Unit(order[2])};
}

ClothTriangle cloth_triangle(const geometry::Mesh& mesh,
                             const std::array<std::uint32_t, 3>& vertices,
                             const std::array<Eigen::Vector3d, 3>& axes) {
  const Eigen::Vector3d& p0 = mesh.vertices_m[vertices[0]];
  const Eigen::Vector3d e1 = mesh.vertices_m[vertices[1]] - p0,
                        e2 = mesh.vertices_m[vertices[2]] - p0, cross = e1.cross(e2);
  const double area_m2 = 0.5 * cross.norm();
  if (!(area_m2 > 0 && std::isfinite(area_m2)))
    throw std::invalid_argument("a triangle of the cloth has no area");
  const Eigen::Vector3d normal = cross.normalized();
  Eigen::Vector3d weft = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& axis : axes) {
    weft = axis - axis.dot(normal) * normal;
    if (weft.norm() >= kMinProjection) break;
  }
  weft.normalize();
  const Eigen::Vector3d warp = normal.cross(weft);
  Eigen::Matrix2d edges;
  edges << e1.dot(weft), e2.dot(weft), e1.dot(warp), e2.dot(warp);
  return {vertices, area_m2, edges.inverse()};
}

struct Neighbour {
  std::uint32_t vertex;
  double distance_m;
};

std::vector<ClothHinge> hinges(const geometry::Mesh& mesh) {
  std::map<Edge, std::vector<std::uint32_t>> opposite;  // vertices opposite to each edge
  for (const auto& [a, b, c] : mesh.triangles) {
    opposite[edge(a, b)].push_back(c);
    opposite[edge(b, c)].push_back(a);
    opposite[edge(c, a)].push_back(b);
  }
  std::vector<ClothHinge> result;
  for (const auto& [e, corners] : opposite)
    for (std::size_t i = 1; i < corners.size(); ++i) {  // several if three triangles share the edge
      ClothHinge hinge{{e.first, e.second, corners[i - 1], corners[i]}, 0, 0};
      std::array<Eigen::Vector3d, 4> p;
      for (std::size_t k = 0; k < 4; ++k) p[k] = mesh.vertices_m[hinge.vertices[k]];
      const Eigen::Vector3d along = p[1] - p[0];
      const double areas_m2 =
          0.5 * (along.cross(p[2] - p[0]).norm() + along.cross(p[3] - p[0]).norm());
      hinge.rest_bend = bend(p)->value;
      hinge.shape = areas_m2 / along.squaredNorm();
      result.push_back(hinge);
    }
  return result;
}

struct NearestPin {
  double distance_m = std::numeric_limits<double>::infinity();
  std::uint32_t pin = 0;
};

// Distances along the edges of the mesh (Dijkstra).
std::vector<NearestPin> nearest_pins(const geometry::Mesh& mesh,
                                     const std::vector<std::uint32_t>& pinned) {
  std::vector<std::vector<Neighbour>> neighbours(mesh.vertices_m.size());
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      const double distance_m = (mesh.vertices_m[a] - mesh.vertices_m[b]).norm();
      neighbours[a].push_back({b, distance_m});
      neighbours[b].push_back({a, distance_m});
    }
  std::vector<NearestPin> nearest(mesh.vertices_m.size());
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (const std::uint32_t pin : pinned) {
    nearest[pin] = {0, pin};
    open.emplace(0.0, pin);
  }
  while (!open.empty()) {
    const auto [distance_m, vertex] = open.top();
    open.pop();
    if (distance_m > nearest[vertex].distance_m) continue;
    for (const Neighbour& next : neighbours[vertex])
      if (const double through_m = distance_m + next.distance_m;
          through_m < nearest[next.vertex].distance_m) {
        nearest[next.vertex] = {through_m, nearest[vertex].pin};
        open.emplace(through_m, next.vertex);
      }
  }
  return nearest;
}

// Fixes the vertices in the pins' boxes and returns them, ascending.
std::vector<std::uint32_t> apply_pins(const geometry::Mesh& mesh,
                                      const Eigen::Isometry3d& world_from_object,
                                      const std::vector<config::ClothPin>& pins,
                                      std::vector<ClothVertex>& vertices) {
  std::vector<std::uint32_t> pinned;
  for (const config::ClothPin& pin : pins) {
    const std::size_t before = pinned.size();
    for (std::uint32_t i = 0; i < mesh.vertices_m.size(); ++i) {
      if (!pin.box_m.contains(mesh.vertices_m[i])) continue;
      pinned.push_back(i);
      if (pin.slides_along)
        vertices[i].slides_along_world =
            world_from_object.linear() * pin.slides_along->normalized();
      else
        vertices[i].inverse_mass_1_kg = 0;
    }
    if (pinned.size() == before)
      throw std::invalid_argument("a pin of the cloth contains no vertex");
  }
  std::sort(pinned.begin(), pinned.end());
  pinned.erase(std::unique(pinned.begin(), pinned.end()), pinned.end());
  return pinned;
}

}  // namespace

ClothModel cloth_model(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object,
                       const config::ClothSettings& settings) {
  ClothModel model;
  const std::array<Eigen::Vector3d, 3> axes = fibre_axes(mesh);
  std::vector<double> mass_kg(mesh.vertices_m.size(), 0.0);
  for (const auto& vertices : mesh.triangles) {
    model.triangles.push_back(cloth_triangle(mesh, vertices, axes));
    for (const std::uint32_t vertex : vertices)
      mass_kg[vertex] += settings.density_kg_m2 * model.triangles.back().area_m2 / 3;
  }
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    model.start_world_m.push_back(world_from_object * mesh.vertices_m[i]);
    // A vertex without a triangle has no mass and stays in place.
    model.vertices.push_back({mass_kg[i] > 0 ? 1 / mass_kg[i] : 0.0});
  }
  const std::vector<std::uint32_t> pinned =
      apply_pins(mesh, world_from_object, settings.pins, model.vertices);
  const std::vector<NearestPin> nearest = nearest_pins(mesh, pinned);
  for (std::uint32_t i = 0; i < nearest.size(); ++i)
    if (nearest[i].distance_m > 0 && std::isfinite(nearest[i].distance_m))
      model.tethers.push_back({i, nearest[i].pin, nearest[i].distance_m});
  for (const ClothTether& tether : model.tethers)
    model.longest_tether_m = std::max(model.longest_tether_m, tether.length_m);
  const auto from_pins_m = [&](const auto& vertices) {
    return std::accumulate(vertices.begin(), vertices.end(), 0.0, [&](double sum, std::uint32_t v) {
      return sum + nearest[v].distance_m;
    });
  };
  const auto nearer = [&](const auto& a, const auto& b) {
    return from_pins_m(a.vertices) < from_pins_m(b.vertices);
  };
  std::stable_sort(model.triangles.begin(), model.triangles.end(), nearer);
  model.hinges = hinges(mesh);
  std::stable_sort(model.hinges.begin(), model.hinges.end(), nearer);
  return model;
}

//        2
//       / \        normals: n_2 = e x (p2 - p0),  n_3 = (p3 - p0) x e
//      /   \       theta > 0 if n_2 turns towards n_3 about e
//     0--e->1
//      \   /       A corner that rises by dz above its triangle turns the normal by -dz / height.
//       \ /
//        3
std::optional<Bend> bend(const std::array<Eigen::Vector3d, 4>& p_m) {
  const Eigen::Vector3d e = p_m[1] - p_m[0];
  const double length_sq = e.squaredNorm();
  Eigen::Vector3d n2 = e.cross(p_m[2] - p_m[0]), n3 = (p_m[3] - p_m[0]).cross(e);
  const double n2_sq = n2.squaredNorm(), n3_sq = n3.squaredNorm();
  if (!(n2_sq > 0 && n3_sq > 0)) return {};
  const double length = std::sqrt(length_sq);
  const Eigen::Vector3d by_2 = -length / n2_sq * n2, by_3 = -length / n3_sq * n3;
  n2 /= std::sqrt(n2_sq);
  n3 /= std::sqrt(n3_sq);
  const double half_cosine = 0.5 * (n2 + n3).norm();
  Bend result;
  result.value = std::copysign((n2 - n3).norm(), n2.cross(n3).dot(e));
  // The corners' gradients turn the edge's vertices the other way, by the lever rule.
  const double lever_2 = (p_m[2] - p_m[0]).dot(e) / length_sq,
               lever_3 = (p_m[3] - p_m[0]).dot(e) / length_sq;
  result.gradient_1_m[2] = half_cosine * by_2;
  result.gradient_1_m[3] = half_cosine * by_3;
  result.gradient_1_m[0] = -half_cosine * ((1 - lever_2) * by_2 + (1 - lever_3) * by_3);
  result.gradient_1_m[1] = -half_cosine * (lever_2 * by_2 + lever_3 * by_3);
  return result;
}

}  // namespace fivepipe::sim
