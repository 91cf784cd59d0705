#include "sim_node/cloth/cloth_contact.h"

#include <algorithm>

#include "common/collision/proximity/moving_triangle.h"
#include "common/collision/response/recovery.h"

namespace fivepipe::sim {
namespace {

using collision::CollisionPoint;
using collision::corners;

// Each point costs a ray. Neighbouring points of a triangle leave the hull together.
constexpr std::size_t kMaxPointsPerTriangle = 8;

// Keeps at most kMaxPointsPerTriangle points of each triangle, evenly. Points are sorted by
// triangle.
std::vector<CollisionPoint> thinned(std::span<const CollisionPoint> points) {
  std::vector<CollisionPoint> kept;
  for (std::size_t begin = 0, end; begin < points.size(); begin = end) {
    end = begin;
    while (end < points.size() && points[end].triangle == points[begin].triangle) ++end;
    const std::size_t stride = (end - begin + kMaxPointsPerTriangle - 1) / kMaxPointsPerTriangle;
    for (std::size_t i = begin; i < end; i += stride) kept.push_back(points[i]);
  }
  return kept;
}

}  // namespace

ClothHullContact::ClothHullContact(const geometry::Mesh& mesh,
                                   const config::ClothSettings& settings)
    : settings_(settings),
      tree_(mesh),
      shifted_world_m_(mesh.vertices_m.size()),
      sides_(mesh.triangles.size()) {
  if (settings_.v_rec_world) settings_.v_rec_world->normalize();
}

void ClothHullContact::reset() { std::fill(sides_.begin(), sides_.end(), Side{}); }

std::vector<ClothContact> ClothHullContact::find(const Cloth& cloth, CurrentHull& hull,
                                                 double step_s, double before_s) {
  shift(cloth);
  tree_.refit(shifted_world_m_);
  std::vector<ClothContact> contacts;
  deepest_m_ = 0;
  triangles_ = 0;
  for (const HullPart& part : hull.parts()) find(cloth, hull, part, step_s, before_s, contacts);
  return contacts;
}

void ClothHullContact::find(const Cloth& cloth, CurrentHull& hull, const HullPart& part,
                            double step_s, double before_s, std::vector<ClothContact>& contacts) {
  const Eigen::Isometry3d newest_from_now = newest_from_before(part, before_s);
  const RigidVelocity velocity = velocity_before(part, before_s + 0.5 * step_s);
  const collision::DetectionObject object{&tree_, newest_from_now,
                                          newest_from_now * tree_.origin_m()};
  const collision::ObjectCollision& collision = hull.detect({&object, 1}).front();
  std::vector<CollisionPoint> of_part;
  for (const CollisionPoint& point : collision.points)
    if (part.box_world_m.contains(point.p_world_m)) of_part.push_back(point);
  const std::size_t first = contacts.size();
  for (const CollisionPoint& point : thinned(of_part)) {
    const std::array<std::uint32_t, 3>& triangle = tree_.mesh().triangles[point.triangle];
    const auto normal =
        direction(point.triangle, cloth, point.p_world_m, newest_from_now.linear(), *hull.query());
    const auto exit =
        normal ? collision::exit_outward(*hull.query(), point.p_world_m,
                                         newest_from_now.linear() * *normal, kMaxClothExit_m)
               : std::nullopt;
    if (!exit) {
      ++without_exit_;
      continue;
    }
    deepest_m_ = std::max(deepest_m_, exit->distance_m);
    const Eigen::Vector3d p_m = newest_from_now.inverse() * point.p_world_m;
    triangles_ += contacts.size() == first || contacts.back().triangle != point.triangle;
    contacts.push_back(
        {point.triangle, collision::barycentric_weights(corners(triangle, shifted_world_m_), p_m),
         *normal, normal->dot(p_m) + exit->distance_m + settings_.thickness_m, velocity.at(p_m)});
  }
}

void ClothHullContact::shift(const Cloth& cloth) {
  const std::vector<Eigen::Vector3d>& vertices_m = cloth.vertices_world_m();
  if (settings_.v_rec_world) {
    for (std::size_t i = 0; i < vertices_m.size(); ++i)
      shifted_world_m_[i] = vertices_m[i] - settings_.thickness_m * *settings_.v_rec_world;
    return;
  }
  shifted_world_m_.assign(vertices_m.size(), Eigen::Vector3d::Zero());
  for (std::size_t t = 0; t < sides_.size(); ++t)
    if (sides_[t].sign != 0)
      for (const std::uint32_t vertex : tree_.mesh().triangles[t])
        shifted_world_m_[vertex] -=
            double(sides_[t].sign) *
            collision::unit_normal(corners(tree_.mesh().triangles[t], vertices_m));
  for (std::size_t i = 0; i < vertices_m.size(); ++i)
    shifted_world_m_[i] = vertices_m[i] + settings_.thickness_m * shifted_world_m_[i].normalized();
}

void ClothHullContact::forget_idle_sides() {
  for (Side& side : sides_)
    if (side.sign != 0 && ++side.steps_without_contact > kSideSteps) side = {};
}

std::optional<Eigen::Vector3d> ClothHullContact::direction(std::uint32_t triangle,
                                                           const Cloth& cloth,
                                                           const Eigen::Vector3d& p_newest_m,
                                                           const Eigen::Matrix3d& newest_from_now,
                                                           const hull::HullQuery& query) {
  if (settings_.v_rec_world) return *settings_.v_rec_world;
  const Eigen::Vector3d normal =
      collision::unit_normal(corners(tree_.mesh().triangles[triangle], cloth.vertices_world_m()));
  if (!(normal.squaredNorm() > 0)) return {};  // a triangle folded to a line
  Side& side = sides_[triangle];
  side.steps_without_contact = 0;
  if (side.sign == 0) {
    const Eigen::Vector3d normal_newest = newest_from_now * normal;
    const auto along = collision::exit_outward(query, p_newest_m, normal_newest, kMaxClothExit_m),
               against =
                   collision::exit_outward(query, p_newest_m, -normal_newest, kMaxClothExit_m);
    if (!along && !against) return {};
    const bool leaves_against = against && (!along || against->distance_m < along->distance_m);
    side.sign = leaves_against ? -1 : 1;
  }
  return double(side.sign) * normal;
}

}  // namespace fivepipe::sim
