#include "common/collision/tracking/first_contact.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/collision/tracking/rotation.h"

namespace fivepipe::collision {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr int kBisections = 6;

// Interpolates two poses: linear translation, constant angular velocity.
Isometry3d between(const Isometry3d& a, const Isometry3d& b, double t) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() =
      Eigen::Quaterniond(a.linear()).slerp(t, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  pose.translation() = (1 - t) * a.translation() + t * b.translation();
  return pose;
}

class ContactSearch {
 public:
  ContactSearch(const HullSnapshot& before, const HullSnapshot& after, const MovingObject& object,
                const FirstContactOptions& options)
      : before_(before), after_(after), object_(object), options_(options) {}

  // Returns the motion of a frame's component from that frame to the fraction t of the interval.
  Isometry3d moved(const HullSnapshot& frame, double t) const {
    const bool is_before = &frame == &before_;
    const Vector3d center =
        (1 - t) * before_.component.centroid_world_m + t * after_.component.centroid_world_m;
    Isometry3d motion = Isometry3d::Identity();
    motion.linear() = rotation((is_before ? t : t - 1) * options_.rotation_world_rad);
    motion.translation() = center - motion.linear() * frame.component.centroid_world_m;
    return motion;
  }

  // Returns an upper bound of the path length of the component's points relative to the object.
  // Both translate at constant velocity and rotate about their centres.
  double path_length_m() const {
    const Isometry3d &from = object_.world_from_object_before,
                     &to = object_.world_from_object_after;
    double radius_m = 0, lever_m = 0;
    for (const HullSnapshot* frame : {&before_, &after_})
      for (int corner = 0; corner < 8; ++corner) {
        const Vector3d p =
            frame->component.box_world_m.corner(Eigen::AlignedBox3d::CornerType(corner));
        radius_m = std::max(radius_m, (p - frame->component.centroid_world_m).norm());
      }
    for (const Isometry3d* pose : {&from, &to})
      for (const HullSnapshot* frame : {&before_, &after_})
        lever_m =
            std::max(lever_m, (pose->translation() - frame->component.centroid_world_m).norm());
    const Vector3d moved = after_.component.centroid_world_m - before_.component.centroid_world_m,
                   object_moved = to.translation() - from.translation();
    const double object_turned_rad =
        Eigen::AngleAxisd(from.linear().transpose() * to.linear()).angle();
    return (moved - object_moved).norm() + options_.rotation_world_rad.norm() * radius_m +
           object_turned_rad * (lever_m + radius_m);
  }

  std::optional<CollisionPoint> at(double t) const {
    const HullSnapshot& frame = t <= 0.5 ? before_ : after_;
    const Isometry3d motion = moved(frame, t);
    const Isometry3d object_pose =
        between(object_.world_from_object_before, object_.world_from_object_after, t);
    const DetectionObject object{object_.tree, motion.inverse() * object_pose,
                                 frame.component.centroid_world_m};
    const DetectionOptions options{
        .eps_m = options_.step_m, .spacing_m = options_.step_m, .max_points = kMaxPoints};
    const ObjectCollision found = detect(*frame.query, {&object, 1}, options)[0];
    for (const CollisionPoint& p : found.points)
      if (frame.component.box_world_m.contains(p.p_world_m))
        return CollisionPoint{motion * p.p_world_m, p.triangle};
    return std::nullopt;
  }

 private:
  // Limit on collision points; they may be in any component of the hull, not only the tracked one.
  static constexpr std::size_t kMaxPoints = 1 << 16;
  const HullSnapshot &before_, &after_;
  const MovingObject& object_;
  const FirstContactOptions& options_;
};

void check(const HullSnapshot& before, const HullSnapshot& after, const MovingObject& object,
           const FirstContactOptions& options) {
  if (!(after.time_s > before.time_s && std::isfinite(before.time_s) &&
        std::isfinite(after.time_s)))
    throw std::invalid_argument(
        "first contact: the later frame's time is not after the previous frame's");
  if (!(options.step_m >= kMinEps_m && std::isfinite(options.step_m)) || options.max_steps < 1)
    throw std::invalid_argument(
        "first contact: step_m is below 1 um or not finite, or max_steps is below 1");
  if (!options.rotation_world_rad.allFinite() ||
      !object.world_from_object_before.matrix().allFinite() ||
      !object.world_from_object_after.matrix().allFinite() ||
      !before.component.centroid_world_m.allFinite() ||
      !after.component.centroid_world_m.allFinite() || before.component.box_world_m.isEmpty() ||
      after.component.box_world_m.isEmpty())
    throw std::invalid_argument(
        "first contact: a pose, rotation, centroid or box is not finite, or a box is empty");
}

}  // namespace

std::optional<FirstContact> first_contact(const HullSnapshot& before, const HullSnapshot& after,
                                          const MovingObject& object,
                                          const FirstContactOptions& options) {
  check(before, after, object, options);
  const ContactSearch contact_search(before, after, object, options);
  if (const auto at_once = contact_search.at(0))
    return FirstContact{before.time_s, 0, at_once->p_world_m, at_once->triangle, false};
  const double needed = std::max(1.0, std::ceil(contact_search.path_length_m() / options.step_m));
  const int steps = int(std::min(needed, double(options.max_steps)));
  for (int step = 1; step <= steps; ++step) {
    double with = double(step) / steps, without = double(step - 1) / steps;
    std::optional<CollisionPoint> found = contact_search.at(with);
    if (!found) continue;
    for (int i = 0; i < kBisections; ++i)
      if (const double t = 0.5 * (without + with); const auto earlier = contact_search.at(t))
        with = t, found = earlier;
      else
        without = t;
    const double span_s = after.time_s - before.time_s;
    return FirstContact{before.time_s + with * span_s, (with - without) * span_s, found->p_world_m,
                        found->triangle, needed > steps};
  }
  return std::nullopt;
}

}  // namespace fivepipe::collision
