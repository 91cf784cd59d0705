#include "common/geometry/closed_mesh.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace fivepipe::geometry {
namespace {

// Returns a number for each vertex: equal for equal positions.
std::vector<std::uint32_t> positions(const Mesh& mesh) {
  const auto less = [&](std::uint32_t a, std::uint32_t b) {
    const Eigen::Vector3d &p = mesh.vertices_m[a], &q = mesh.vertices_m[b];
    return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  };
  std::vector<std::uint32_t> order(mesh.vertices_m.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), less);
  std::vector<std::uint32_t> position(order.size());
  for (std::size_t i = 1; i < order.size(); ++i)
    position[order[i]] = position[order[i - 1]] + (less(order[i - 1], order[i]) ? 1 : 0);
  return position;
}

}  // namespace

std::size_t open_edges(const Mesh& mesh) {
  struct Edge {
    std::pair<std::uint32_t, std::uint32_t> ends;  // the lower position first
    int direction;                                 // 1: from the lower one; -1: to it
  };
  const std::vector<std::uint32_t> position = positions(mesh);
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = position[triangle[i]], to = position[triangle[(i + 1) % 3]];
      if (from != to) edges.push_back({std::minmax(from, to), from < to ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.ends < b.ends; });
  std::size_t open = 0;
  for (auto first = edges.begin(); first != edges.end();) {
    const auto end = std::find_if(first, edges.end(),
                                  [&](const Edge& edge) { return edge.ends != first->ends; });
    const int sum = std::accumulate(
        first, end, 0, [](int total, const Edge& edge) { return total + edge.direction; });
    open += sum != 0;
    first = end;
  }
  return open;
}

double enclosed_volume_m3(const Mesh& mesh) {
  const Eigen::Vector3d center_m = bounds_m(mesh).center();  // near it, rounding is smallest
  double volume_m3 = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p_m = mesh.vertices_m[a] - center_m, q_m = mesh.vertices_m[b] - center_m,
                          r_m = mesh.vertices_m[c] - center_m;
    volume_m3 += p_m.dot(q_m.cross(r_m)) / 6;
  }
  return volume_m3;
}

}  // namespace fivepipe::geometry
