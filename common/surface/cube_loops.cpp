#include "common/surface/cube_loops.h"

#include <bit>
#include <cstddef>
#include <optional>

namespace fivepipe::surface {
namespace {

// Corners of each face, counter-clockwise as seen from outside of the cube.
constexpr std::array<std::array<int, 4>, 6> kFaces = {
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

int edge_between(int a, int b) {
  const int axis = std::countr_zero(unsigned(a ^ b)), corner = a & b;
  for (int edge = 4 * axis; edge < 4 * axis + 4; ++edge)
    if (kEdgeCorner[std::size_t(edge)] == corner) return edge;
  return -1;
}

bool are_on_one_face(int edge_a, int edge_b) {
  const auto holds = [](const std::array<int, 4>& face, int edge) {
    int ends = 0;
    for (std::size_t i = 0; i < 4; ++i) ends += edge_between(face[i], face[(i + 1) % 4]) == edge;
    return ends > 0;
  };
  for (const auto& face : kFaces)
    if (holds(face, edge_a) && holds(face, edge_b)) return true;
  return false;
}

// For each crossed edge the next one of its loop: on each face, a run of inside corners is cut off
// from the edge where it begins to the edge where it ends.
std::array<int, kCubeEdges> next_edges(unsigned inside) {
  std::array<int, kCubeEdges> next;
  next.fill(-1);
  const auto is_inside = [&](int corner) { return (inside >> corner & 1) != 0; };
  for (const auto& face : kFaces)
    for (std::size_t i = 0; i < 4; ++i) {
      const int before = face[(i + 3) % 4];
      if (!is_inside(face[i]) || is_inside(before)) continue;
      std::size_t last = i;
      while (is_inside(face[(last + 1) % 4])) last = (last + 1) % 4;
      next[std::size_t(edge_between(before, face[i]))] =
          edge_between(face[last], face[(last + 1) % 4]);
    }
  return next;
}

// Returns the place in the loop from which triangles fan out without an edge on a face; nullopt if
// there is none.
std::optional<std::size_t> fan_start(const std::vector<int>& loop) {
  const std::size_t n = loop.size();
  for (std::size_t start = 0; start < n; ++start) {
    bool is_good = true;
    for (std::size_t i = 2; i + 1 < n; ++i)
      is_good = is_good && !are_on_one_face(loop[start], loop[(start + i) % n]);
    if (is_good) return start;
  }
  return std::nullopt;
}

CubeSurface surface_of(unsigned inside) {
  CubeSurface surface;
  std::array<int, kCubeEdges> next = next_edges(inside);
  for (int first = 0; first < kCubeEdges; ++first) {
    if (next[std::size_t(first)] < 0) continue;
    std::vector<int> loop;
    for (int edge = first; next[std::size_t(edge)] >= 0;) {
      loop.push_back(edge);
      const int following = next[std::size_t(edge)];
      next[std::size_t(edge)] = -1;
      edge = following;
    }
    const std::size_t n = loop.size();
    const auto start = fan_start(loop);
    if (start) {
      for (std::size_t i = 1; i + 1 < n; ++i)
        surface.triangles.push_back(
            {loop[*start], loop[(*start + i) % n], loop[(*start + i + 1) % n]});
    } else {
      const int middle = kCubeEdges + int(surface.loops.size());
      for (std::size_t i = 0; i < n; ++i)
        surface.triangles.push_back({middle, loop[i], loop[(i + 1) % n]});
    }
    surface.loops.push_back({std::move(loop), !start});
  }
  return surface;
}

}  // namespace

const CubeSurface& cube_surface(unsigned inside) {
  static const std::vector<CubeSurface> table = [] {
    std::vector<CubeSurface> all;
    for (unsigned i = 0; i < 256; ++i) all.push_back(surface_of(i));
    return all;
  }();
  return table[inside];
}

}  // namespace fivepipe::surface
