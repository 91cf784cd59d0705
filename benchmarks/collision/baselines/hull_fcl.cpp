#include "benchmarks/collision/baselines/hull_fcl.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

}  // namespace

struct HullFcl::Models {
  std::vector<std::shared_ptr<Model>> objects;
  std::shared_ptr<Model> hull;  // null if the hull is empty
};

HullFcl::HullFcl() : models_(std::make_unique<Models>()) {}
HullFcl::~HullFcl() = default;

std::size_t HullFcl::add(const geometry::Mesh& mesh_world_m) {
  models_->objects.push_back(model_of(mesh_world_m));
  return models_->objects.size() - 1;
}

void HullFcl::refit(std::size_t object, std::span<const Eigen::Vector3d> vertices_world_m) {
  Model& model = *models_->objects[object];
  model.beginReplaceModel();
  for (const Eigen::Vector3d& v : vertices_world_m) model.replaceVertex(v);
  model.endReplaceModel(true, true);
}

void HullFcl::set_hull(const geometry::Mesh& hull_world_m) {
  models_->hull = hull_world_m.triangles.empty() ? nullptr : model_of(hull_world_m);
}

collision::ObjectCollision HullFcl::query(std::size_t object) const {
  collision::ObjectCollision found;
  if (!models_->hull) return found;
  fcl::CollisionRequest<double> request(std::numeric_limits<std::size_t>::max(), false);
  fcl::CollisionResult<double> result;
  auto still = fcl::Transform3<double>::Identity(), still_too = still;
  fcl::detail::MeshCollisionTraversalNode<Boxes> traversal;
  if (!fcl::detail::initialize(traversal, *models_->objects[object], still, *models_->hull,
                               still_too, request, result))
    return found;
  fcl::detail::collide(&traversal);
  std::vector<fcl::Contact<double>> contacts;
  result.getContacts(contacts);
  for (const auto& contact : contacts)
    found.points.push_back({shared_point(corners_of(*models_->objects[object], contact.b1),
                                         corners_of(*models_->hull, contact.b2)),
                            std::uint32_t(contact.b1)});
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
