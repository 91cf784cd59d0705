#include "benchmarks/collision/baselines/hull_fcl.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace fivepipe::baselines {
namespace {

using Boxes = fcl::AABB<double>;
using Model = fcl::BVHModel<Boxes>;

std::shared_ptr<Model> model_of(const geometry::Mesh& mesh) {
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
  auto model = std::make_shared<Model>();
  model->bv_splitter =
      std::make_shared<fcl::detail::BVSplitter<Boxes>>(fcl::detail::SPLIT_METHOD_BV_CENTER);
  model->beginModel(int(mesh.triangles.size()), int(mesh.vertices_m.size()));
  model->addSubModel(mesh.vertices_m, triangles);
  model->endModel();
  return model;
}

using Corners = std::array<Eigen::Vector3d, 3>;

Corners corners_of(const Model& model, std::intptr_t triangle) {
  const fcl::Triangle& t = model.tri_indices[triangle];
  return {model.vertices[t[0]], model.vertices[t[1]], model.vertices[t[2]]};
}

// The part of the two planes' common line that is in a triangle, as parameters along the line.
// The triangles are known to intersect.
struct Span {
  double from = std::numeric_limits<double>::infinity(), to = -from;
};
Span across(const Corners& t, const Eigen::Vector3d& normal, double offset,
            const Eigen::Vector3d& line) {
  Span span;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d &a = t[i], &b = t[(i + 1) % 3];
    const double da = normal.dot(a) - offset, db = normal.dot(b) - offset;
    if ((da < 0) == (db < 0)) continue;
    const double at = line.dot(a) + da / (da - db) * (line.dot(b) - line.dot(a));
    span.from = std::min(span.from, at);
    span.to = std::max(span.to, at);
  }
  return span;
}

// Returns the midpoint of the intersection of two triangles, or a corner if they are coplanar.
Eigen::Vector3d shared_point(const Corners& a, const Corners& b) {
  const Eigen::Vector3d na = (a[1] - a[0]).cross(a[2] - a[0]),
                        nb = (b[1] - b[0]).cross(b[2] - b[0]), line = na.cross(nb);
  const double oa = na.dot(a[0]), ob = nb.dot(b[0]), square = line.squaredNorm();
  const Span sa = across(a, nb, ob, line), sb = across(b, na, oa, line);
  const double from = std::max(sa.from, sb.from), to = std::min(sa.to, sb.to);
  if (!(square > 0 && std::isfinite(from) && std::isfinite(to))) return a[0];
  return (oa * nb.cross(line) + ob * line.cross(na) + 0.5 * (from + to) * line) / square;
}

// Returns a point for each pair of triangles that intersect.
std::vector<collision::CollisionPoint> crossings(Model& mesh, Model& hull) {
  fcl::CollisionRequest<double> request(std::numeric_limits<std::size_t>::max(), false);
  fcl::CollisionResult<double> result;
  auto still = fcl::Transform3<double>::Identity(), still_too = still;
  fcl::detail::MeshCollisionTraversalNode<Boxes> traversal;
  if (!fcl::detail::initialize(traversal, mesh, still, hull, still_too, request, result)) return {};
  fcl::detail::collide(&traversal);
  std::vector<fcl::Contact<double>> contacts;
  result.getContacts(contacts);
  std::vector<collision::CollisionPoint> points;
  for (const auto& contact : contacts)
    points.push_back({shared_point(corners_of(mesh, contact.b1), corners_of(hull, contact.b2)),
                      std::uint32_t(contact.b1)});
  return points;
}

// The triangles at each vertex, and a triangle of each connected component of a mesh.
struct Topology {
  std::vector<std::vector<std::uint32_t>> triangles_at;
  std::vector<std::uint32_t> of_components;
};

Topology topology_of(const geometry::Mesh& mesh) {
  Topology topology{std::vector<std::vector<std::uint32_t>>(mesh.vertices_m.size()), {}};
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t v : mesh.triangles[i]) topology.triangles_at[v].push_back(i);
  std::vector<char> reached(mesh.triangles.size());
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (reached[i]) continue;
    topology.of_components.push_back(i);
    for (open.assign(1, i); !open.empty();) {
      const std::uint32_t t = open.back();
      open.pop_back();
      if (std::exchange(reached[t], true)) continue;
      for (const std::uint32_t v : mesh.triangles[t])
        open.insert(open.end(), topology.triangles_at[v].begin(), topology.triangles_at[v].end());
    }
  }
  return topology;
}

// Adds the triangles that cross no surface and have a corner in the volume, with that corner. They
// are connected to a crossing triangle by such corners, or fill a component of the mesh. The search
// begins there, so that its time grows with the contact and not with the mesh.
void add_enclosed(const Model& mesh, const Topology& topology,
                  const std::function<bool(const Eigen::Vector3d&)>& in_volume,
                  std::vector<collision::CollisionPoint>& points) {
  std::vector<char> done(std::size_t(mesh.num_tris)), tested(std::size_t(mesh.num_vertices));
  std::vector<std::uint32_t> open = topology.of_components;
  for (const collision::CollisionPoint& p : points)
    if (!std::exchange(done[p.triangle], true)) open.push_back(p.triangle);
  while (!open.empty()) {
    const fcl::Triangle& corners = mesh.tri_indices[open.back()];
    open.pop_back();
    for (const std::size_t v : {corners[0], corners[1], corners[2]}) {
      if (std::exchange(tested[v], true) || !in_volume(mesh.vertices[v])) continue;
      for (const std::uint32_t t : topology.triangles_at[v]) {
        if (std::exchange(done[t], true)) continue;
        points.push_back({mesh.vertices[v], t});
        open.push_back(t);
      }
    }
  }
}

}  // namespace

struct HullFcl::Models {
  struct Object {
    std::shared_ptr<Model> model;
    Topology topology;
  };
  std::vector<Object> objects;
  std::shared_ptr<Model> hull;  // null if the hull is empty
};

HullFcl::HullFcl() : models_(std::make_unique<Models>()) {}
HullFcl::~HullFcl() = default;

std::size_t HullFcl::add(const geometry::Mesh& mesh_world_m) {
  models_->objects.push_back({model_of(mesh_world_m), topology_of(mesh_world_m)});
  return models_->objects.size() - 1;
}

void HullFcl::refit(std::size_t object, std::span<const Eigen::Vector3d> vertices_world_m) {
  Model& model = *models_->objects[object].model;
  model.beginReplaceModel();
  for (const Eigen::Vector3d& v : vertices_world_m) model.replaceVertex(v);
  model.endReplaceModel(true, true);
}

void HullFcl::set_hull(const geometry::Mesh& hull_world_m) {
  models_->hull = hull_world_m.triangles.empty() ? nullptr : model_of(hull_world_m);
}

collision::ObjectCollision HullFcl::query(
    std::size_t object,
    const std::function<bool(const Eigen::Vector3d& p_world_m)>& in_volume) const {
  collision::ObjectCollision found;
  if (!models_->hull) return found;
  const Models::Object& queried = models_->objects[object];
  found.points = crossings(*queried.model, *models_->hull);
  add_enclosed(*queried.model, queried.topology, in_volume, found.points);
  std::stable_sort(found.points.begin(), found.points.end(),
                   [](const collision::CollisionPoint& a, const collision::CollisionPoint& b) {
                     return a.triangle < b.triangle;
                   });
  for (const collision::CollisionPoint& p : found.points)
    if (found.triangles.empty() || found.triangles.back() != p.triangle)
      found.triangles.push_back(p.triangle);
  if (!found.points.empty()) found.verdict = collision::CollisionVerdict::colliding;
  return found;
}

}  // namespace fivepipe::baselines
