#include "common/collision/proximity/proximity.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <stdexcept>

#include "common/collision/proximity/moving_triangle.h"
#include "common/collision/proximity/proximity_search.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Queries per work item.
constexpr int kBatchSize = 64;

template <class Work>
void for_many(base::WorkerPool& pool, std::size_t count, const Work& work) {
  pool.run(int((count + kBatchSize - 1) / kBatchSize), [&](int piece, int thread) {
    const std::size_t begin = std::size_t(piece) * kBatchSize;
    for (std::size_t i = begin; i < std::min(begin + kBatchSize, count); ++i) work(i, thread);
  });
}

}  // namespace

HullProximity::HullProximity(const hull::HullQuery& query, const ProximityOptions& options) {
  if (!(options.cap_m > 0 && std::isfinite(options.cap_m) && options.tolerance_m > 0))
    throw std::invalid_argument("proximity: cap_m and tolerance_m must be positive, cap_m finite");
  search_ = std::make_unique<Search>(query, options);
}
HullProximity::~HullProximity() = default;

void HullProximity::of_points(std::span<const Vector3d> p_world_m, std::span<Proximity> proximity) {
  for_many(search_->query.hull().pool(), p_world_m.size(), [&](std::size_t i, int thread) {
    proximity[i] = search_->of_point(p_world_m[i], thread);
  });
}

void HullProximity::of_triangles(std::span<const Triangle> triangles,
                                 std::span<Proximity> proximity) {
  for_many(search_->query.hull().pool(), triangles.size(), [&](std::size_t i, int thread) {
    proximity[i] = search_->of_triangle(triangles[i], kUnknown, thread);
  });
}

// Derives bounds for a triangle from its vertices: the distance to the hull is 1-Lipschitz.
static Proximity known_from_vertices(const Triangle& triangle,
                                     const std::array<Proximity, 3>& vertices) {
  Proximity known = kUnknown;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d& vertex = triangle[i];
    const double reach_m = std::sqrt(std::max((triangle[(i + 1) % 3] - vertex).squaredNorm(),
                                              (triangle[(i + 2) % 3] - vertex).squaredNorm()));
    known.min_m =
        std::max(known.min_m, vertices[i].min_m - reach_m -
                                  kDistanceRoundings * (vertex.cwiseAbs().sum() + reach_m));
    known.max_m = std::min(known.max_m, vertices[i].max_m);
  }
  return {std::min(known.min_m, known.max_m), known.max_m};
}

MeshProximity HullProximity::of_mesh(const geometry::Mesh& mesh,
                                     const Eigen::Isometry3d& world_from_object) {
  std::vector<Vector3d> vertices_world_m;
  vertices_world_m.reserve(mesh.vertices_m.size());
  for (const Vector3d& v : mesh.vertices_m) vertices_world_m.push_back(world_from_object * v);
  MeshProximity found{std::vector<Proximity>(mesh.vertices_m.size()),
                      std::vector<Proximity>(mesh.triangles.size())};
  of_points(vertices_world_m, found.vertices);
  for_many(search_->query.hull().pool(), mesh.triangles.size(), [&](std::size_t i, int thread) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Triangle triangle = {vertices_world_m[a], vertices_world_m[b], vertices_world_m[c]};
    found.triangles[i] = search_->of_triangle(
        triangle,
        known_from_vertices(triangle, {found.vertices[a], found.vertices[b], found.vertices[c]}),
        thread);
  });
  return found;
}

namespace {

// A box of the tree, or with level -1 a triangle.
struct PartCandidate {
  double from_m;  // lower bound of its distance to the hull
  int level, index;
  // Sorts the nearest candidate first in a priority queue.
  bool operator<(const PartCandidate& other) const { return from_m > other.from_m; }
};

}  // namespace

Proximity HullProximity::of_part(const Bvh& tree, const Eigen::Isometry3d& world_from_part,
                                 double enough_m) {
  const hull::HullQuery& query = search_->query;
  const ProximityOptions& options = search_->options;
  if (query.hull().unusable() || !world_from_part.matrix().allFinite()) return kUnknown;
  if (query.hull().empty() || tree.empty()) return kEmptyHull;
  std::priority_queue<PartCandidate> queue;
  const auto push = [&](int level, int index, const Vector3d& center_m, const Vector3d& half_m) {
    const Vector3d center_world_m = world_from_part * center_m;
    const double radius_m = half_m.norm(),
                 rounding_m = kDistanceRoundings * (center_world_m.cwiseAbs().sum() + radius_m);
    queue.push({query.free_radius_m(center_world_m) - radius_m - rounding_m, level, index});
  };
  const auto push_boxes = [&](int level, int node) {
    const Bvh::Boxes& boxes = tree.boxes(level, node);
    for (std::size_t i = 0; i < Bvh::kArity; ++i) {
      const Vector3d center_m(boxes.center_m[0][i], boxes.center_m[1][i], boxes.center_m[2][i]),
          half_m(boxes.half_m[0][i], boxes.half_m[1][i], boxes.half_m[2][i]);
      if (half_m.x() >= 0)
        push(level, node * Bvh::kArity + int(i), tree.origin_m() + center_m, half_m);
    }
  };
  const auto triangle = [&](int i) {
    return corners(tree.mesh().triangles[std::size_t(i)], tree.mesh().vertices_m);
  };

  Proximity whole{kInfinity, kInfinity};
  push_boxes(tree.levels() - 1, 0);
  while (!queue.empty()) {
    const PartCandidate next = queue.top();
    queue.pop();
    if (next.from_m >= std::min({options.cap_m, enough_m, whole.max_m - options.tolerance_m})) {
      whole.min_m = std::min(whole.min_m, std::max(0.0, next.from_m));
      break;  // all others are farther
    }
    if (next.level > 0) {
      push_boxes(next.level - 1, next.index);
    } else if (next.level == 0) {
      for (const std::uint32_t i : tree.triangles_of(next.index)) {
        const TriangleShape shape(triangle(int(i)));
        push(-1, int(i), shape.center, shape.half_extents_m);
      }
    } else {
      Triangle t = triangle(next.index);
      for (Vector3d& vertex : t) vertex = world_from_part * vertex;
      const Proximity found = search_->of_triangle(t, {0, whole.max_m}, 0);
      if (!(found.max_m > 0)) return kInHull;
      whole = {std::min(whole.min_m, found.min_m), std::min(whole.max_m, found.max_m)};
    }
  }
  return whole;
}

}  // namespace fivepipe::collision
