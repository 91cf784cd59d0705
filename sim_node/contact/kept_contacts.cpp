#include "sim_node/contact/kept_contacts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/collision/response/recovery.h"
#include "sim_node/contact/support_points.h"
#include "sim_node/objects/rigid_bodies.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

double above_m(const KeptContact& plane, const Vector3d& p_world_m) {
  return plane.normal_world.dot(p_world_m - plane.on_hull_world_m);
}

// Whether the measured contact is on the kept one's plane, within the maps' resolution.
bool shares_plane(const KeptContact& measured, const KeptContact& kept) {
  return measured.normal_world.dot(kept.normal_world) >= std::cos(kSamePlane_rad) &&
         std::abs(above_m(kept, measured.on_hull_world_m)) <= kPlaneTolerance * kept.footprint_m;
}

void take_plane(KeptContact& contact, const KeptContact& from, const Vector3d& p_world_m) {
  contact.normal_world = from.normal_world;
  contact.on_hull_world_m = p_world_m - above_m(from, p_world_m) * from.normal_world;
}

// Returns how far the hull's surface is from the plane along its normal: 0 if it is near, nullopt
// if there is none within reach.
std::optional<double> surface_m(const KeptContact& contact, const hull::HullQuery& query,
                                double reach_m) {
  const double tolerance_m = kPlaneTolerance * contact.footprint_m;
  const Vector3d &plane_m = contact.on_hull_world_m, &normal = contact.normal_world;
  const bool is_full = query.contains(plane_m - tolerance_m * normal),
             is_free = !query.contains(plane_m + tolerance_m * normal);
  if (is_full && is_free) return 0.0;
  if (!(reach_m > tolerance_m)) return std::nullopt;
  if (!is_free) {
    const auto exit = collision::exit_outward(query, plane_m, normal, reach_m);
    return exit ? std::optional(exit->distance_m) : std::nullopt;
  }
  const auto entry = query.first_entry({plane_m, -normal}, 0, reach_m);
  return entry ? std::optional(-*entry) : std::nullopt;
}

// Returns the height of each contact's point above its plane, relative to the lowest on its side:
// a side that is deeper must not displace the contacts of another one.
std::vector<double> heights_m(const std::vector<KeptContact>& contacts,
                              const Eigen::Isometry3d& world_from_object) {
  std::vector<double> above_plane_m, height_m(contacts.size(), 0);
  for (const KeptContact& contact : contacts)
    above_plane_m.push_back(distance_m(contact, world_from_object));
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (std::size_t k = 0; k < contacts.size(); ++k)
      if (contacts[i].normal_world.dot(contacts[k].normal_world) > kSameSide)
        height_m[i] = std::max(height_m[i], above_plane_m[i] - above_plane_m[k]);
  return height_m;
}

// Returns at most kMaxHullContacts of the contacts, in their order (support_points.h). height_m: of
// each contact. Requires a contact.
std::vector<KeptContact> supporting(const std::vector<KeptContact>& contacts,
                                    std::span<const double> height_m) {
  std::vector<Vector3d> points_m;
  for (const KeptContact& contact : contacts) points_m.push_back(contact.on_hull_world_m);
  std::vector<std::size_t> chosen = support_points(
      points_m, height_m, {kMaxHullContacts, kTouchesFirst * contacts.front().footprint_m, 0});
  std::sort(chosen.begin(), chosen.end());  // the solver's result depends on the order
  std::vector<KeptContact> kept;
  for (const std::size_t i : chosen) kept.push_back(contacts[i]);
  return kept;
}

const HullPart* part_of(const KeptContact& contact, std::span<const HullPart> parts) {
  for (const HullPart& part : parts)
    if (part.id == contact.part) return &part;
  // The point is on the part's border; its box may end a pixel earlier.
  const Vector3d margin_m = Vector3d::Constant(kPlaneTolerance * contact.footprint_m);
  for (const HullPart& part : parts)
    if (Eigen::AlignedBox3d(part.box_world_m.min() - margin_m, part.box_world_m.max() + margin_m)
            .contains(contact.on_hull_world_m))
      return &part;
  return nullptr;
}

}  // namespace

Vector3d point_world_m(const KeptContact& contact, const Eigen::Isometry3d& world_from_object) {
  return contact.ball_radius_m > 0
             ? world_from_object.translation() - contact.ball_radius_m * contact.normal_world
             : world_from_object * contact.on_object_m;
}

double distance_m(const KeptContact& contact, const Eigen::Isometry3d& world_from_object) {
  return above_m(contact, point_world_m(contact, world_from_object));
}

void drop_left(std::vector<KeptContact>& contacts, std::uint64_t part,
               const Eigen::Isometry3d& world_from_object) {
  std::erase_if(contacts, [&](const KeptContact& contact) {
    if (contact.part != part) return false;
    const Vector3d moved_m = point_world_m(contact, world_from_object) - contact.on_hull_world_m;
    const double above = contact.normal_world.dot(moved_m);
    return !(above <= contact.footprint_m &&
             (moved_m - above * contact.normal_world).norm() <= contact.footprint_m);
  });
}

std::vector<SurfaceMotion> follow_hull(std::vector<KeptContact>& contacts,
                                       std::span<const HullPart> parts, double between_s,
                                       const hull::HullQuery& query, double reach_m) {
  std::map<std::uint64_t, std::vector<Vector3d>> moves_m;  // by part
  std::erase_if(contacts, [&](KeptContact& contact) {
    const HullPart* const part = part_of(contact, parts);
    if (!part) return true;
    const Eigen::Isometry3d motion = newest_from_before(*part, between_s);
    contact.part = part->id;
    contact.on_hull_world_m = motion * contact.on_hull_world_m;
    contact.normal_world = motion.linear() * contact.normal_world;
    const auto moved_m = surface_m(contact, query, reach_m);
    if (!moved_m) return true;
    if (*moved_m == 0) return false;
    const Vector3d move_m = *moved_m * contact.normal_world;
    contact.on_hull_world_m += move_m;
    moves_m[contact.part].push_back(move_m);
    return false;
  });
  // Parts may have merged, and their contacts with them.
  std::map<std::uint64_t, std::vector<KeptContact>> by_part;
  for (const KeptContact& contact : contacts) by_part[contact.part].push_back(contact);
  contacts.clear();
  for (const auto& [part, of_part] : by_part)
    for (const KeptContact& contact : supporting(of_part, std::vector<double>(of_part.size(), 0.0)))
      contacts.push_back(contact);
  std::vector<SurfaceMotion> motions;
  for (const auto& [part, of_part_m] : moves_m) {
    const Vector3d sum_m =
        std::accumulate(of_part_m.begin(), of_part_m.end(), Vector3d(Vector3d::Zero()));
    motions.push_back({part, sum_m / (double(of_part_m.size()) * between_s)});
  }
  return motions;
}

bool is_on_kept_plane(std::span<const KeptContact> contacts, const Vector3d& p_world_m) {
  for (const KeptContact& plane : contacts) {
    const double tolerance_m = kPlaneTolerance * plane.footprint_m;
    if (!(std::abs(above_m(plane, p_world_m)) <= tolerance_m)) continue;
    Vector3d center_m = Vector3d::Zero();
    double count = 0;
    for (const KeptContact& other : contacts)
      if (other.normal_world == plane.normal_world) center_m += other.on_hull_world_m, ++count;
    center_m /= count;
    double radius_m = tolerance_m;
    for (const KeptContact& other : contacts)
      if (other.normal_world == plane.normal_world)
        radius_m = std::max(radius_m, (other.on_hull_world_m - center_m).norm() + tolerance_m);
    if ((p_world_m - center_m).norm() <= radius_m) return true;
  }
  return false;
}

void add_contacts(std::vector<KeptContact>& contacts, std::uint64_t part,
                  std::span<const KeptContact> measured,
                  const Eigen::Isometry3d& world_from_object) {
  std::vector<KeptContact> with_part;
  std::erase_if(contacts, [&](const KeptContact& contact) {
    if (contact.part == part) with_part.push_back(contact);
    return contact.part == part;
  });
  for (KeptContact contact : measured) {
    const auto same =
        std::find_if(with_part.begin(), with_part.end(),
                     [&](const KeptContact& kept) { return shares_plane(contact, kept); });
    if (same != with_part.end()) {
      take_plane(contact, *same, point_world_m(contact, world_from_object));
      const Vector3d point_m = point_world_m(contact, world_from_object);
      if (std::any_of(with_part.begin(), with_part.end(), [&](const KeptContact& kept) {
            return kept.normal_world == contact.normal_world &&
                   (point_world_m(kept, world_from_object) - point_m).norm() <= contact.footprint_m;
          }))
        continue;
    }
    with_part.push_back(contact);
  }
  if (with_part.empty()) return;
  for (const KeptContact& contact : supporting(with_part, heights_m(with_part, world_from_object)))
    contacts.push_back(contact);
}

}  // namespace fivepipe::sim
