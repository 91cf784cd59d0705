#include "sim_node/contact/contact_probe.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "common/collision/response/ball_contact.h"
#include "common/collision/response/farthest_point_sample.h"
#include "common/collision/response/recovery.h"
#include "sim_node/contact/support_points.h"
#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Smallest reach of the search for an exit [m]; a larger object may leave by its own size.
constexpr double kMinReach_m = 0.05;
// Parts of a contact this many footprints apart are contacts of their own.
constexpr double kPatchGap = 3;
// Cells of a patch per footprint of a pixel: the normal's error falls with their number.
constexpr double kCellsPerFootprint = 3;
// Number of points of a patch at which the hull's surface is measured.
constexpr std::size_t kPlaneSamples = 16;
// Contacts on opposite sides that are deeper than this, in footprints, cannot both be obeyed.
constexpr double kOpposed = 3;
// Patches whose normals' cosines to the first direction differ by less are equally similar: 3.6
// degrees if one has that direction, a degree if it is 6 degrees from it.
constexpr double kSimilar = 0.002;
// Number of times that a contact is measured: its first direction is that of a few pixels.
constexpr int kProbes = 2;

Vector3d mean(const std::vector<Vector3d>& points_m) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points_m) sum += p;
  return sum / double(points_m.size());
}

// The centre of a patch that touches first, and the hull's normal there: unit, out of the hull.
struct FirstTouch {
  Vector3d center_world_m, normal_world;
};

double distance_m(const collision::ContactPatch& patch, const Vector3d& p_world_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Vector3d& q_m : patch.points_world_m)
    nearest_m = std::min(nearest_m, (q_m - p_world_m).norm());
  return nearest_m;
}

// Returns the patch with the most similar normal; of equally similar ones the nearest, and of
// equally near ones the first, which is the largest.
const collision::ContactPatch& patch_grown_from(
    const FirstTouch& touch, const std::vector<collision::ContactPatch>& patches) {
  assert(!patches.empty());
  double highest = -1;
  for (const collision::ContactPatch& patch : patches)
    highest = std::max(highest, patch.normal_world.dot(touch.normal_world));
  const collision::ContactPatch* nearest = nullptr;
  double nearest_m = 0;
  for (const collision::ContactPatch& patch : patches) {
    if (patch.normal_world.dot(touch.normal_world) < highest - kSimilar) continue;
    const double away_m = distance_m(patch, touch.center_world_m);
    if (nearest && !(away_m < nearest_m - collision::kEqual_m)) continue;
    nearest = &patch;
    nearest_m = away_m;
  }
  return *nearest;
}

}  // namespace

PlacedObject moved(PlacedObject placed, const Vector3d& move_world_m) {
  placed.world_from_object = Eigen::Translation3d(move_world_m) * placed.world_from_object;
  placed.center_world_m += move_world_m;
  return placed;
}

ContactProbe::ContactProbe(const config::Scene& scene, const ObjectModels& models,
                           CurrentHull& hull)
    : models_(models),
      hull_(hull),
      ball_radius_m_(scene.objects.size(), 0),
      surface_m_(scene.objects.size()) {
  for (const config::SceneObject& object : scene.objects)
    joints_.push_back(object.joint ? std::optional(Jointed{*object.joint, object.world_from_object})
                                   : std::nullopt);
  for (const std::size_t object : models.touching) {
    if (const auto* ball = std::get_if<config::SphereShape>(&scene.objects[object].shape))
      ball_radius_m_[object] = ball->radius_m;
    surface_m_[object] =
        collision::surface_points_m(models.objects[object].bvh.mesh(), kSurfacePoints_m);
  }
}

collision::ObjectCollision ContactProbe::detect(const PlacedObject& placed) {
  const collision::DetectionObject object{&models_.objects[placed.object].bvh,
                                          placed.world_from_object, placed.center_world_m};
  collision::ObjectCollision found = std::move(hull_.detect({&object, 1}).front());
  // The hull holds the other parts too, at their places of the newest frame.
  std::erase_if(found.points, [&](const collision::CollisionPoint& point) {
    return !placed.part.box_world_m.contains(point.p_world_m);
  });
  return found;
}

bool ContactProbe::is_explained(const PlacedObject& placed,
                                std::span<const KeptContact> contacts) const {
  std::vector<Vector3d> points_m;
  for (const Vector3d& p_m : surface_m_[placed.object])
    points_m.push_back(placed.world_from_object * p_m);
  std::vector<std::uint8_t> inside(points_m.size());
  hull_.query()->contains(points_m, inside);
  for (std::size_t i = 0; i < points_m.size(); ++i)
    if (inside[i] && placed.part.box_world_m.contains(points_m[i]) &&
        !is_on_kept_plane(contacts, points_m[i]))
      return false;
  return true;
}

std::vector<collision::ContactPatch> ContactProbe::patches(
    const PlacedObject& placed, const collision::ObjectCollision& collision) {
  if (collision.points.empty()) return {};
  const double footprint_m =
      collision::pixel_footprint_m(*hull_.query(), collision.points.front().p_world_m);
  std::vector<collision::ContactPatch> patches = collision::contact_patches(
      *hull_.query(), models_.objects[placed.object].bvh.mesh(), placed.world_from_object,
      collision.triangles,
      {.cell_m = footprint_m / kCellsPerFootprint, .gap_m = kPatchGap * footprint_m});
  std::erase_if(patches, [&](const collision::ContactPatch& patch) {
    return !placed.part.box_world_m.contains(patch.points_world_m.front());
  });
  return patches;
}

std::vector<KeptContact> ContactProbe::planes(const PlacedObject& placed,
                                              const collision::ContactPatch& patch) const {
  const hull::HullQuery& query = *hull_.query();
  const Vector3d& normal = patch.normal_world;
  const double footprint_m = collision::pixel_footprint_m(query, patch.points_world_m.front()),
               reach_m = std::max(kMinReach_m, 2 * models_.objects[placed.object].radius_m);
  std::vector<double> height_m;
  for (const Vector3d& p_world_m : patch.points_world_m) height_m.push_back(normal.dot(p_world_m));
  std::vector<KeptContact> planes;
  double top_m = -std::numeric_limits<double>::infinity();  // of the hull along the normal
  for (const std::size_t i :
       support_points(patch.points_world_m, height_m,
                      {kPlaneSamples, kTouchesFirst * footprint_m, footprint_m})) {
    const Vector3d& p_world_m = patch.points_world_m[i];
    const auto exit = collision::exit_outward(query, p_world_m, normal, reach_m);
    if (!exit) continue;
    planes.push_back({.part = placed.part.id,
                      .on_object_m = placed.world_from_object.inverse() * p_world_m,
                      .on_hull_world_m = p_world_m + exit->distance_m * normal,
                      .normal_world = normal,
                      .footprint_m = footprint_m,
                      .ball_radius_m = ball_radius_m_[placed.object]});
    top_m = std::max(top_m, normal.dot(planes.back().on_hull_world_m));
  }
  const auto below_top_m = [&](const KeptContact& contact) {
    return top_m - normal.dot(contact.on_hull_world_m);
  };
  if (ball_radius_m_[placed.object] > 0 && !planes.empty()) {
    planes.resize(1);
    planes[0].on_hull_world_m = placed.world_from_object.translation();
    planes[0].on_hull_world_m += below_top_m(planes[0]) * normal;
    return planes;
  }
  // Heights within the maps' resolution are one plane, the highest, on which the object rests. It
  // comes first, because add_contacts() lets others share the first plane.
  const auto others =
      std::stable_partition(planes.begin(), planes.end(), [&](const KeptContact& contact) {
        return below_top_m(contact) <= kPlaneTolerance * footprint_m;
      });
  for (auto contact = planes.begin(); contact != others; ++contact)
    contact->on_hull_world_m += below_top_m(*contact) * normal;
  return planes;
}

std::vector<KeptContact> ContactProbe::measure(const PlacedObject& at_touch,
                                               const collision::ObjectCollision& collision) {
  const hull::HullQuery& query = *hull_.query();
  std::vector<FirstTouch> touches;
  for (const collision::ContactPatch& patch : patches(at_touch, collision))
    if (touches.size() < kMaxHullContacts)
      touches.push_back({mean(patch.points_world_m), patch.normal_world});
  const Vector3d& first_m = collision.points.front().p_world_m;
  if (touches.empty())  // smaller than a cell: towards RP_obj, as in the paper
    touches.push_back({first_m, (at_touch.center_world_m - first_m).normalized()});
  const double footprint_m = collision::pixel_footprint_m(query, first_m),
               probe_m = kProbe * footprint_m, ball_m = ball_radius_m_[at_touch.object];
  const Isometry3d& touch_pose = at_touch.world_from_object;
  std::vector<KeptContact> contacts;
  std::vector<Vector3d> measured_m;  // the centres of the patches
  for (FirstTouch touch : touches) {
    for (int probe = 0; probe < kProbes; ++probe) {
      const PlacedObject probed = moved(at_touch, -probe_m * touch.normal_world);
      const auto found = patches(probed, detect(probed));
      if (found.empty()) break;
      collision::ContactPatch patch = patch_grown_from(touch, found);
      touch.normal_world = patch.normal_world;
      if (probe + 1 < kProbes) continue;
      if (ball_m > 0)
        patch.normal_world = collision::ball_contact_normal(query, touch_pose.translation(), ball_m,
                                                            patch.normal_world);
      // Pixels that touch first at several places may belong to one patch.
      const Vector3d center_m = mean(patch.points_world_m);
      if (std::any_of(measured_m.begin(), measured_m.end(), [&](const Vector3d& other_m) {
            return (other_m - center_m).norm() <= kPatchGap * footprint_m;
          }))
        continue;
      measured_m.push_back(center_m);
      for (KeptContact& contact : planes(probed, patch)) {
        const double above_m = distance_m(contact, touch_pose);
        contact.on_hull_world_m =
            point_world_m(contact, touch_pose) - above_m * contact.normal_world;
        contacts.push_back(contact);
      }
    }
  }
  drop_opposed(at_touch, contacts);
  return contacts.empty() ? escape(at_touch, collision) : contacts;
}

bool ContactProbe::can_move(const PlacedObject& placed, const Vector3d& p_world_m,
                            const Vector3d& direction_world, double footprint_m) const {
  const auto& joint = joints_[placed.object];
  if (!joint) return true;
  const Isometry3d now_from_newest = placed.newest_from_now.inverse();
  const Vector3d rate = joint->rate(now_from_newest * p_world_m),
                 direction = now_from_newest.linear() * direction_world;
  // Within a pixel of the limit it is at the limit.
  const double position = joint->position(now_from_newest * placed.world_from_object),
               margin = footprint_m / std::max(rate.norm(), kMinJointLever_m),
               gain = rate.dot(direction);
  if (gain > 0) return position < joint->joint.highest - margin;
  return gain < 0 && position > joint->joint.lowest + margin;
}

// A hull that appears in an object is on both sides of it. Drops the contacts that the joint cannot
// follow if there are others, and those in the direction with the longer exit.
void ContactProbe::drop_opposed(const PlacedObject& placed,
                                std::vector<KeptContact>& contacts) const {
  const Isometry3d& pose = placed.world_from_object;
  const auto can_follow = [&](const KeptContact& contact) {
    return can_move(placed, point_world_m(contact, pose), contact.normal_world,
                    contact.footprint_m);
  };
  if (std::any_of(contacts.begin(), contacts.end(), can_follow))
    std::erase_if(contacts, [&](const KeptContact& contact) {
      return !can_follow(contact) && -distance_m(contact, pose) > kOpposed * contact.footprint_m;
    });
  const std::vector<KeptContact> all = contacts;
  const auto deepest_along_m = [&](const Vector3d& normal) {
    double deepest_m = 0;
    for (const KeptContact& contact : all)
      if (contact.normal_world.dot(normal) > kSameSide)
        deepest_m = std::max(deepest_m, -distance_m(contact, pose));
    return deepest_m;
  };
  std::erase_if(contacts, [&](const KeptContact& contact) {
    const double here_m = deepest_along_m(contact.normal_world),
                 opposite_m = deepest_along_m(-contact.normal_world);
    return opposite_m > kOpposed * contact.footprint_m && here_m > opposite_m;
  });
}

std::vector<KeptContact> ContactProbe::escape(const PlacedObject& placed,
                                              const collision::ObjectCollision& collision) const {
  std::vector<Vector3d> points_m;
  for (const collision::CollisionPoint& point : collision.points)
    points_m.push_back(point.p_world_m);
  const Vector3d center_m = mean(points_m), to_center_m = placed.center_world_m - center_m;
  const double footprint_m = collision::pixel_footprint_m(*hull_.query(), center_m);
  std::vector<Vector3d> directions;
  if (const auto& joint = joints_[placed.object]) {
    const Vector3d rate =
        placed.newest_from_now.linear() * joint->rate(placed.newest_from_now.inverse() * center_m);
    if (rate.norm() > kMinJointLever_m)
      for (const double sign : {1.0, -1.0})
        if (can_move(placed, center_m, sign * rate, footprint_m))
          directions.push_back(sign * rate.normalized());
  } else {
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) directions.push_back(sign * Vector3d::Unit(axis));
    if (to_center_m.norm() > footprint_m) directions.push_back(to_center_m.normalized());
  }
  std::vector<KeptContact> shortest;
  double shortest_m = std::numeric_limits<double>::infinity();
  for (const Vector3d& direction : directions) {
    const std::vector<KeptContact> contacts =
        planes(placed, {.normal_world = direction, .points_world_m = points_m});
    double deepest_m = 0;
    for (const KeptContact& contact : contacts)
      deepest_m = std::max(deepest_m, -distance_m(contact, placed.world_from_object));
    if (!contacts.empty() && deepest_m < shortest_m) {
      shortest_m = deepest_m;
      shortest = contacts;
    }
  }
  return shortest;
}

}  // namespace fivepipe::sim
