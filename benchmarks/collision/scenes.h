// The scenes of the collision benchmark: maps of real objects that are known in closed form, and
// virtual meshes that collide with their hull. They are deterministic.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/collision/detection/triangle.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::collision_bench {

struct SceneObject {
  geometry::Mesh mesh;  // every vertex belongs to a triangle
  Eigen::Isometry3d world_from_mesh;
  bool deforms;  // the vertices move in every frame, so its tree is refitted
};

struct CollisionScene {
  std::string name;
  std::vector<hull::Capsule> real_objects;  // empty for real maps
  std::vector<hull::Silhouette> silhouettes;
  std::vector<SceneObject> objects;
  std::vector<std::vector<collision::Triangle>>
      objects_world_m;                 // as triangles, in the order of `objects`
  Eigen::AlignedBox3d volume_world_m;  // contains the hull, for methods that need a volume
  std::size_t triangles() const;
};

// The cameras of scenes/rigs/paper.yaml (the three on the walls) and scenes/rigs/table4.yaml:
// 720x486, above a table whose top is z = 0.
std::vector<geometry::Camera> paper_cameras();
std::vector<geometry::Camera> table_cameras();

// The paper's curtain of 720 triangles, which deforms. A hand and forearm press at least 5 cm
// through it lengthwise, so that at least a tenth of the triangles cross the hull's border. The
// cameras are the paper's.
CollisionScene curtain720();
// Twelve blocks on the table; a hand between them touches some. This and the following scenes have
// the four cameras around the table.
CollisionScene blocks();
// A CAD-like assembly of 50,000 triangles; a hand reaches into it.
CollisionScene payload();
// A rippled sheet of a million triangles under a hand; 0.8 % of them are nearer than kNear_m to the
// hull.
CollisionScene dense();
inline constexpr double kNear_m = 0.005;
// A plate of 80 triangles with 6 cm legs. A finger pierces each, so every triangle crosses the
// hull's border.
CollisionScene full();
// Fingers of 2 mm through triangles of 2 cm, seen by the same cameras with a narrower field of
// view: a map pixel is 0.5 mm wide at the plate.
CollisionScene thin();

// Reads the maps of seated4cam from a folder that `fivepipe maps` has written, with two chairs and
// a table made of boxes. Throws std::runtime_error that names the file and the error, or if the
// folder has another name.
CollisionScene real_scene(const std::filesystem::path& folder);

}  // namespace fivepipe::collision_bench
