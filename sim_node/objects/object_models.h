// Meshes, sizes and roles of the scene's objects. A simulation changes only the meshes of cloths.
#pragma once
#include <vector>

#include "common/collision/detection/bvh.h"
#include "common/config/scene.h"

namespace fivepipe::sim {

struct ObjectModel {
  collision::Bvh bvh;  // of the object's mesh, in the object's frame; see Simulation
  double radius_m;     // of the smallest ball that has the box's centre and contains the mesh
  double flatness_m;   // how far triangles lie below the surface that they approximate
};

struct ObjectModels {
  std::vector<ObjectModel> objects;    // in the scene's order
  std::vector<std::size_t> reacting;   // objects with a report, ascending
  std::vector<std::size_t> bouncing;   // dynamic objects that bounce off the hull, ascending
  std::vector<std::size_t> touching;   // dynamic objects in contact with the hull, ascending
  Eigen::AlignedBox3d start_bounds_m;  // world box of all objects at the start and spacings
};

// Throws std::invalid_argument if a mesh is invalid (bvh.h).
ObjectModels object_models(const config::Scene& scene);

}  // namespace fivepipe::sim
