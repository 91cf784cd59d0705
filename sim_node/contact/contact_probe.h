// Measures the contacts of an object that touches a part of the hull.
//
// If the hull is on both sides, as in a closed door in which a hull appears, the object has no
// normal. It then leaves in the escape direction with the shortest exit: those of its joint, or the
// world's axes and towards its centre.
//
// Fewer pixels than kProbe of depth do not determine a normal. The object is therefore measured
// that deep: moved in along the normal of its first patch (contact_patch.h), its patches there give
// the normals of the contacts' planes. A ball's normal is that of the smooth hull (ball_contact.h).
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/collision/response/contact_patch.h"
#include "common/config/scene.h"
#include "sim_node/contact/kept_contacts.h"
#include "sim_node/hull/current_hull.h"
#include "sim_node/objects/joint_motion.h"
#include "sim_node/objects/object_models.h"

namespace fivepipe::sim {

// An object relative to a part of the hull at the part's place of the newest frame.
struct PlacedObject {
  std::size_t object;  // index in the scene
  const HullPart& part;
  Eigen::Isometry3d newest_from_now;  // motion of the part up to the newest frame
  Eigen::Isometry3d world_from_object;
  Eigen::Vector3d center_world_m;
};
PlacedObject moved(PlacedObject placed, const Eigen::Vector3d& move_world_m);

class ContactProbe {
 public:
  // Borrows models and hull, which must outlive this object.
  ContactProbe(const config::Scene& scene, const ObjectModels& models, CurrentHull& hull);

  // Returns the collision of the object with the part. Requires hull.query(), as all below.
  collision::ObjectCollision detect(const PlacedObject& placed);
  // Returns whether the object touches the part only where it keeps these contacts with it. Tests
  // points of the object's surface, kSurfacePoints_m apart: much faster than detect(), for an
  // object that rests, but the hull may enter between the points.
  bool is_explained(const PlacedObject& placed, std::span<const KeptContact> contacts) const;
  // Returns the contacts of the object where it first touches the part, with their planes. They may
  // be none, if no exit is within reach. `collision` is that at this place, with points.
  std::vector<KeptContact> measure(const PlacedObject& at_touch,
                                   const collision::ObjectCollision& collision);

 private:
  std::vector<collision::ContactPatch> patches(const PlacedObject& placed,
                                               const collision::ObjectCollision& collision);
  // Whether the joint can move the object's point in this direction, from its present position.
  bool can_move(const PlacedObject& placed, const Eigen::Vector3d& p_world_m,
                const Eigen::Vector3d& direction_world, double footprint_m) const;
  void drop_opposed(const PlacedObject& placed, std::vector<KeptContact>& contacts) const;
  // The contacts of the shortest way out of the hull.
  std::vector<KeptContact> escape(const PlacedObject& placed,
                                  const collision::ObjectCollision& collision) const;
  // The planes of a patch of the object at this place.
  std::vector<KeptContact> planes(const PlacedObject& placed,
                                  const collision::ContactPatch& patch) const;

  const ObjectModels& models_;
  CurrentHull& hull_;
  std::vector<double> ball_radius_m_;                    // by object; 0: not a ball
  std::vector<std::vector<Eigen::Vector3d>> surface_m_;  // by object: points, in its frame
  std::vector<std::optional<Jointed>> joints_;           // by object
};

// Depth at which a contact is measured, in footprints of a pixel. The patch of a ball of 30 mm then
// covers some 100 pixels of 2 mm.
inline constexpr double kProbe = 1.5;
// As far apart as the collision points by default (SimConfig::spacing_m): about a pixel.
inline constexpr double kSurfacePoints_m = 0.003;

}  // namespace fivepipe::sim
