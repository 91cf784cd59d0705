#include "sim_node/particles/object_touches.h"

#include <algorithm>

#include "sim_node/particles/solid_touch.h"
#include "sim_node/particles/surface_touch.h"

namespace fivepipe::sim {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

AlignedBox3d grown(const AlignedBox3d& box_m, double by_m) {
  return {box_m.min().array() - by_m, box_m.max().array() + by_m};
}

// Returns true if the bounding box of the particle's path in the step overlaps the box.
bool may_meet(const AlignedBox3d& box_m, const Vector3d& from_m, const Vector3d& to_m) {
  return (from_m.cwiseMin(to_m).array() <= box_m.max().array()).all() &&
         (from_m.cwiseMax(to_m).array() >= box_m.min().array()).all();
}

std::optional<SolidTouch> touch_shape(const config::Shape& shape, const collision::Bvh& tree,
                                      const PathInStep& path) {
  if (const auto* box = std::get_if<config::BoxShape>(&shape))
    return touch_box(0.5 * box->size_m, path);
  if (const auto* sphere = std::get_if<config::SphereShape>(&shape))
    return touch_ball(sphere->radius_m, path);
  const auto found = touch_mesh(tree, {}, 0, path);
  return found ? std::optional(found->touch) : std::nullopt;
}

}  // namespace

ObjectTouches::ObjectTouches(const config::Scene& scene, const ObjectModels& models,
                             const RigidBodies& bodies, const ClothObjects* cloths)
    : scene_(scene),
      models_(models),
      bodies_(bodies),
      cloths_(cloths),
      is_known_(scene.objects.size(), false),
      world_from_before_(scene.objects.size()),
      world_from_now_(scene.objects.size()) {
  for (const ObjectModel& model : models.objects)
    bounds_m_.push_back(geometry::bounds_m(model.bvh.mesh()));
  if (!cloths_) return;
  for (std::size_t i = 0; i < cloths_->objects().size(); ++i)
    cloth_trees_.push_back({cloths_->objects()[i],
                            i,
                            collision::Bvh(models.objects[cloths_->objects()[i]].bvh.mesh()),
                            {}});
}

void ObjectTouches::reset() { is_known_.assign(is_known_.size(), false); }

void ObjectTouches::begin() {
  for (std::size_t i = 0; i < world_from_now_.size(); ++i) {
    const Eigen::Isometry3d now = bodies_.world_from_object(i);
    world_from_before_[i] = is_known_[i] ? world_from_now_[i] : now;
    world_from_now_[i] = now;
  }
  for (ClothTree& cloth : cloth_trees_) {
    const std::vector<Vector3d>& now_m = cloths_->cloth(cloth.position).vertices_world_m();
    cloth.before_world_m = is_known_[cloth.object] ? cloth.tree.mesh().vertices_m : now_m;
    cloth.tree.refit(now_m);
    cloth.moved_m = 0;
    for (std::size_t v = 0; v < now_m.size(); ++v)
      cloth.moved_m = std::max(cloth.moved_m, (now_m[v] - cloth.before_world_m[v]).norm());
  }
  is_known_.assign(is_known_.size(), true);
}

void ObjectTouches::step(const config::ParticleSource& source, ParticleSet& particles) const {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    if (scene_.objects[i].motion != config::Motion::cloth) touch_rigid(i, source, particles);
  for (const ClothTree& cloth : cloth_trees_) touch_cloth(cloth, source, particles);
}

AlignedBox3d ObjectTouches::swept_world_m(std::size_t object) const {
  return bounds_m_[object]
      .transformed(world_from_before_[object])
      .merged(bounds_m_[object].transformed(world_from_now_[object]));
}

void ObjectTouches::touch_rigid(std::size_t object, const config::ParticleSource& source,
                                ParticleSet& particles) const {
  const AlignedBox3d swept_m = grown(swept_world_m(object), source.radius_m);
  const Eigen::Isometry3d before_from_world = world_from_before_[object].inverse(),
                          now_from_world = world_from_now_[object].inverse();
  const bool moves = scene_.objects[object].motion == config::Motion::dynamic;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Vector3d& p_m = particles.p_world_m[i];
    if (!may_meet(swept_m, particles.before_world_m[i], p_m)) continue;
    const auto found = touch_shape(
        scene_.objects[object].shape, models_.objects[object].bvh,
        {before_from_world * particles.before_world_m[i], now_from_world * p_m, source.radius_m});
    if (!found) continue;
    respond(source,
            {world_from_now_[object].linear() * found->normal, found->distance_m,
             moves ? bodies_.velocity_m_s(object, p_m) : Vector3d::Zero().eval()},
            p_m, particles.v_world_m_s[i]);
  }
}

void ObjectTouches::touch_cloth(const ClothTree& cloth, const config::ParticleSource& source,
                                ParticleSet& particles) const {
  AlignedBox3d swept_m;
  for (const Vector3d& p_m : cloth.before_world_m) swept_m.extend(p_m);
  for (const Vector3d& p_m : cloth.tree.mesh().vertices_m) swept_m.extend(p_m);
  swept_m = grown(swept_m, source.radius_m);
  const std::vector<Vector3d>& velocities_m_s =
      cloths_->cloth(cloth.position).velocities_world_m_s();
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Vector3d& p_m = particles.p_world_m[i];
    if (!may_meet(swept_m, particles.before_world_m[i], p_m)) continue;
    const auto found = touch_mesh(cloth.tree, cloth.before_world_m, cloth.moved_m,
                                  {particles.before_world_m[i], p_m, source.radius_m});
    if (!found) continue;
    const auto& [a, b, c] = cloth.tree.mesh().triangles[found->triangle];
    const Vector3d velocity_m_s = found->weights.x() * velocities_m_s[a] +
                                  found->weights.y() * velocities_m_s[b] +
                                  found->weights.z() * velocities_m_s[c];
    respond(source, {found->touch.normal, found->touch.distance_m, velocity_m_s}, p_m,
            particles.v_world_m_s[i]);
  }
}

}  // namespace fivepipe::sim
