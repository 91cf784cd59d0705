// What the overlays show of the objects' collision results.
#pragma once
#include <Eigen/Core>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/scene.h"

namespace fivepipe::render {

// The move out of the hull (paper, section 4.3), in the world frame.
struct RecoveryMark {
  Eigen::Vector3d cp_object_world_m, cp_hull_world_m;
  bool still_colliding = false;  // the object collides elsewhere after the move
};

struct HullNormalMark {
  Eigen::Vector3d cp_hull_world_m;
  Eigen::Vector3d n_hull_world;  // unit, outward
  bool is_closed_form = false;   // otherwise from the paper's four points
};

// The marks of one object in one frame.
struct CollisionMarks {
  std::size_t object = 0;                            // index in the scene
  std::vector<Eigen::Vector3f> points_world_m = {};  // CP_i
  std::optional<RecoveryMark> recovery = {};         // absent: no exit from the hull was found
  std::vector<HullNormalMark> hull_normals = {};     // at most one of each kind
  // Lower bound of the distance to the hull of each vertex or triangle, as a fraction of the cap:
  // 0 to 1; 1: at the cap or beyond. Empty: no proximity is shown.
  std::vector<float> proximity = {};
};

// An object of the scene of which the overlays show something.
struct OverlaidObject {
  std::size_t object = 0;                // index in the scene
  std::set<config::Overlay> shown = {};  // those of the scene's overlays that the object reports
  geometry::Mesh mesh = {};              // object frame; empty unless proximity is shown
  config::ProximityOf proximity_of = config::ProximityOf::vertices;
  // Number of values of a proximity field of the object.
  std::size_t proximity_values() const {
    return proximity_of == config::ProximityOf::vertices ? mesh.vertices_m.size()
                                                         : mesh.triangles.size();
  }
};

// Returns the objects of which the scene's overlays show something, by name.
std::map<std::string, OverlaidObject> overlaid_objects(const config::Scene& scene);

}  // namespace fivepipe::render
