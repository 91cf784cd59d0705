// Independent checks of closed meshes.
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "common/geometry/mesh.h"

namespace fivepipe::test {

// Returns why the mesh is no closed, consistently oriented 2-manifold; empty: it is one. Each
// directed edge must occur once and its opposite once, and the triangles at a vertex must form one
// closed fan.
inline std::string manifold_fault(const geometry::Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> fans;  // vertex: from, to
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
      if (a == b || a >= mesh.vertices_m.size()) return "a triangle has no three vertices";
      if (++edges[{a, b}] > 1) return fmt::format("edge {} {} occurs twice", a, b);
      fans[a][b] = c;
    }
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge.second, edge.first}))
      return fmt::format("edge {} {} has one triangle", edge.first, edge.second);
  for (const auto& [vertex, fan] : fans) {
    std::size_t steps = 0;
    std::uint32_t at = fan.begin()->first;
    do at = fan.at(at), ++steps;
    while (at != fan.begin()->first && steps <= fan.size());
    if (steps != fan.size()) return fmt::format("the triangles at vertex {} form two fans", vertex);
  }
  return fans.size() == mesh.vertices_m.size() ? "" : "a vertex has no triangle";
}

// Returns the mesh with one vertex for each position, as a file without indices states it.
inline geometry::Mesh merged(const geometry::Mesh& mesh) {
  std::map<std::array<double, 3>, std::uint32_t> number_of;
  geometry::Mesh result;
  std::vector<std::uint32_t> numbers;
  for (const Eigen::Vector3d& p : mesh.vertices_m) {
    const auto [at, is_new] =
        number_of.emplace(std::array{p.x(), p.y(), p.z()}, result.vertices_m.size());
    if (is_new) result.vertices_m.push_back(p);
    numbers.push_back(at->second);
  }
  for (const auto& [a, b, c] : mesh.triangles)
    result.triangles.push_back({numbers[a], numbers[b], numbers[c]});
  return result;
}

// Whether points are inside a closed mesh, by the triangles above them.
class MeshInside {
 public:
  MeshInside(const geometry::Mesh& mesh, double bucket_m) : mesh_(mesh), bucket_m_(bucket_m) {
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      Eigen::AlignedBox3d box;
      for (const std::uint32_t v : mesh.triangles[i]) box.extend(mesh.vertices_m[v]);
      for (int x = bucket_of(box.min().x()); x <= bucket_of(box.max().x()); ++x)
        for (int y = bucket_of(box.min().y()); y <= bucket_of(box.max().y()); ++y)
          triangles_at_[{x, y}].push_back(i);
    }
  }
  bool contains(const Eigen::Vector3d& p) const {
    const auto bucket = triangles_at_.find({bucket_of(p.x()), bucket_of(p.y())});
    if (bucket == triangles_at_.end()) return false;
    int above = 0;  // downward faces less upward ones
    for (const std::uint32_t i : bucket->second) {
      const auto& t = mesh_.triangles[i];
      const Eigen::Vector3d a = mesh_.vertices_m[t[0]] - p, b = mesh_.vertices_m[t[1]] - p,
                            c = mesh_.vertices_m[t[2]] - p;
      const double ab = a.x() * b.y() - a.y() * b.x(), bc = b.x() * c.y() - b.y() * c.x(),
                   ca = c.x() * a.y() - c.y() * a.x(), sum = ab + bc + ca;
      const bool is_up = ab >= 0 && bc >= 0 && ca >= 0, is_down = ab < 0 && bc < 0 && ca < 0;
      if ((is_up || is_down) && sum != 0 && (bc * a.z() + ca * b.z() + ab * c.z()) / sum > 0)
        above += is_up ? 1 : -1;
    }
    return above != 0;
  }

 private:
  int bucket_of(double at_m) const { return int(std::floor(at_m / bucket_m_)); }
  const geometry::Mesh& mesh_;
  double bucket_m_;
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> triangles_at_;
};

}  // namespace fivepipe::test
