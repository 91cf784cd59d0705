#include "sim_node/cloth/cloth_objects.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::sim {
namespace {

// The estimate of the hull's speed decays with a time constant of 1 s, as the cloth's velocity does
// by the default air drag.
constexpr double kForgetSpeed_1_s = 1.0;

}  // namespace

ClothObjects::ClothObjects(const config::Scene& scene, const MovingObjects* rigid)
    : gravity_world_m_s2_(0, 0, -scene.gravity_m_s2) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const config::SceneObject& object = scene.objects[i];
    if (object.motion != config::Motion::cloth) continue;
    const geometry::Mesh mesh = config::mesh_of(object);
    Cloth cloth(mesh, object.world_from_object, *object.cloth);
    Eigen::AlignedBox3d bounds_m;
    for (const Eigen::Vector3d& p : cloth.vertices_world_m()) bounds_m.extend(p);
    const double free_fall_m_s = std::sqrt(2 * scene.gravity_m_s2 * bounds_m.diagonal().norm());
    std::optional<ClothSelfContact> self_contact;
    if (object.cloth->self_collision)
      self_contact.emplace(mesh, cloth.vertices_world_m(), object.cloth->thickness_m);
    std::optional<ClothObjectContact> object_contact;
    if (object.cloth->object_collision) {
      assert(rigid);
      object_contact.emplace(cloth, *rigid, object.cloth->thickness_m);
    }
    objects_.push_back(i);
    cloths_.push_back(
        {std::move(cloth),
         ClothHullContact(mesh, *object.cloth),
         std::move(self_contact),
         std::move(object_contact),
         object.world_from_object.inverse(),
         {bounds_m.min().array() - kLostCloth_m, bounds_m.max().array() + kLostCloth_m},
         free_fall_m_s,
         object.reaction == config::Reaction::yield});
  }
}

void ClothObjects::step(double step_s, std::uint64_t steps_left, CurrentHull& hull,
                        double before_s) {
  for (OneCloth& one : cloths_) step(one, step_s, steps_left, hull, before_s);
}

void ClothObjects::step(OneCloth& one, double step_s, std::uint64_t steps_left, CurrentHull& hull,
                        double before_s) {
  const bool touchable = one.leaves_hull && hull.query(), moves = hull.history();
  // The way out of a hull that is held is divided among the steps.
  const double share = moves ? 1 : 1 / double(steps_left);
  std::vector<ClothContact> contacts;
  one.contact.forget_idle_sides();
  if (touchable) contacts = one.contact.find(one.cloth, hull, step_s, before_s);
  const std::size_t triangles = touchable ? one.contact.triangles() : 0;
  counters_.contacts += !contacts.empty();
  one.hull_speed_m_s /= 1 + kForgetSpeed_1_s * step_s;
  if (!moves && !contacts.empty())
    one.hull_speed_m_s = std::max(one.hull_speed_m_s, share * one.contact.deepest_m() / step_s);
  for (const ClothContact& contact : contacts)
    one.hull_speed_m_s = std::max(one.hull_speed_m_s, contact.velocity_world_m_s.norm());
  one.cloth.step(step_s, gravity_world_m_s2_, contacts, share,
                 one.hull_speed_m_s + one.free_fall_m_s);
  counters_.unrecovered += one.contact.take_without_exit();
  const std::vector<Eigen::Vector3d>& vertices_m = one.cloth.vertices_world_m();
  if (!std::all_of(vertices_m.begin(), vertices_m.end(), [&](const Eigen::Vector3d& p) {
        return p.allFinite() && one.bounds_world_m.contains(p);
      })) {
    reset(one);
    ++counters_.reset;
    return;
  }
  if (one.self_contact) counters_.self_contacts += one.self_contact->separate(one.cloth);
  // The hull comes last: a virtual object may yield, a real one does not.
  if (one.object_contact)
    counters_.object_contacts += one.object_contact->separate(one.cloth, step_s);
  if (!touchable || !(moves || steps_left == 1)) return;
  project(one, hull, step_s, before_s);
  if (steps_left == 1) one.hull_contacts = {triangles, one.contact.deepest_m()};
}

// Moves only finite vertices, by at most kMaxClothExit_m each time.
void ClothObjects::project(OneCloth& one, CurrentHull& hull, double step_s, double before_s) {
  for (int i = 0; i < kMaxClothProjections; ++i) {
    const std::vector<ClothContact> contacts = one.contact.find(one.cloth, hull, step_s, before_s);
    const bool has_exits = one.contact.take_without_exit() == 0;  // step() has counted the others
    if (!(one.contact.deepest_m() > kClothIndifferent_m)) {
      counters_.still_colliding += !has_exits;
      return;
    }
    if (!one.cloth.project(contacts)) break;  // the rest is fixed
  }
  ++counters_.still_colliding;
}

void ClothObjects::reset() {
  for (OneCloth& one : cloths_) reset(one);
}

void ClothObjects::reset(OneCloth& one) {
  one.cloth.reset();
  one.contact.reset();
  if (one.self_contact) one.self_contact->reset();
  if (one.object_contact) one.object_contact->reset(one.cloth);
  one.hull_speed_m_s = 0;
  one.hull_contacts = {};
}

std::vector<Eigen::Vector3d> ClothObjects::vertices_object_m(std::size_t i) const {
  std::vector<Eigen::Vector3d> vertices_m;
  for (const Eigen::Vector3d& p : cloths_[i].cloth.vertices_world_m())
    vertices_m.push_back(cloths_[i].object_from_world * p);
  return vertices_m;
}

}  // namespace fivepipe::sim
