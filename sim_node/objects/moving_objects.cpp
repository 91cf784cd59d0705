#include "sim_node/objects/moving_objects.h"

#include "sim_node/objects/solid_contact.h"

namespace fivepipe::sim {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Isometry3d;
using Eigen::Vector3d;

std::optional<SolidContact> shape_contact(const config::Shape& shape, const collision::Bvh& tree,
                                          const PathInStep& path) {
  if (const auto* box = std::get_if<config::BoxShape>(&shape))
    return box_contact(0.5 * box->size_m, path);
  if (const auto* sphere = std::get_if<config::SphereShape>(&shape))
    return ball_contact(sphere->radius_m, path);
  const auto found = mesh_contact(tree, {}, 0, path);
  return found ? std::optional(found->plane) : std::nullopt;
}

}  // namespace

bool may_meet(const AlignedBox3d& box_m, const Vector3d& from_m, const Vector3d& to_m) {
  return (from_m.cwiseMin(to_m).array() <= box_m.max().array()).all() &&
         (from_m.cwiseMax(to_m).array() >= box_m.min().array()).all();
}

MovingObjects::MovingObjects(const config::Scene& scene, const ObjectModels& models,
                             const RigidBodies& bodies)
    : scene_(scene),
      models_(models),
      bodies_(bodies),
      is_known_(scene.objects.size(), false),
      world_from_before_(scene.objects.size(), Isometry3d::Identity()),
      world_from_now_(scene.objects.size(), Isometry3d::Identity()) {
  for (const ObjectModel& model : models.objects)
    bounds_m_.push_back(geometry::bounds_m(model.bvh.mesh()));
}

void MovingObjects::begin_step() {
  for (std::size_t i = 0; i < world_from_now_.size(); ++i) {
    const Isometry3d now = bodies_.world_from_object(i);
    world_from_before_[i] = is_known_[i] ? world_from_now_[i] : now;
    world_from_now_[i] = now;
  }
  is_known_.assign(is_known_.size(), true);
}

std::vector<MovingObjects::Swept> MovingObjects::swept(double radius_m) const {
  std::vector<Swept> swept;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i)
    if (scene_.objects[i].motion != config::Motion::cloth)
      swept.push_back(Swept(*this, i, radius_m));
  return swept;
}

MovingObjects::Swept::Swept(const MovingObjects& objects, std::size_t object, double radius_m)
    : objects_(objects),
      object_(object),
      radius_m_(radius_m),
      before_from_world_(objects.world_from_before_[object].inverse()),
      now_from_world_(objects.world_from_now_[object].inverse()) {
  const AlignedBox3d& bounds_m = objects.bounds_m_[object];
  box_world_m_ = bounds_m.transformed(objects.world_from_before_[object])
                     .merged(bounds_m.transformed(objects.world_from_now_[object]));
  box_world_m_ = {box_world_m_.min().array() - radius_m, box_world_m_.max().array() + radius_m};
}

std::optional<SurfaceContact> MovingObjects::Swept::contact(const Vector3d& from_m,
                                                            const Vector3d& to_m) const {
  if (!may_meet(box_world_m_, from_m, to_m)) return std::nullopt;
  const config::SceneObject& object = objects_.scene_.objects[object_];
  const auto found =
      shape_contact(object.shape, objects_.models_.objects[object_].bvh,
                    {before_from_world_ * from_m, now_from_world_ * to_m, radius_m_});
  if (!found || !(found->distance_m < radius_m_)) return std::nullopt;
  return SurfaceContact{
      objects_.world_from_now_[object_].linear() * found->normal, found->distance_m,
      object.motion == config::Motion::dynamic ? objects_.bodies_.velocity_m_s(object_, to_m)
                                               : Vector3d::Zero().eval()};
}

}  // namespace fivepipe::sim
