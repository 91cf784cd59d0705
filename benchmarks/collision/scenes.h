// What the collision benchmark looks at: maps of real objects known in closed form, and virtual
// meshes against them. Always the same.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/collision/detection/triangle.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::collision_bench {

struct SceneObject {
  geometry::Mesh mesh;  // triangles of no vertex but its own
  Eigen::Isometry3d world_from_mesh;
  bool deforms;  // its vertices move from frame to frame: a tree over it is refitted in each
};

struct CollisionScene {
  std::string name;
  std::vector<hull::Capsule> real_objects;  // empty: real maps
  std::vector<hull::Silhouette> silhouettes;
  std::vector<SceneObject> objects;
  std::vector<std::vector<collision::Triangle>> objects_world_m;  // the same, as triangles
  Eigen::AlignedBox3d volume_world_m;  // holds the hull: for methods that need to know
  std::size_t triangles() const;
};

// Cameras of scenes/rigs/paper.yaml (the three on the walls) and scenes/rigs/table4.yaml: 720x486,
// in a room above a table whose top is z = 0.
std::vector<geometry::Camera> paper_cameras();
std::vector<geometry::Camera> table_cameras();

// The paper's curtain of 720 triangles, deforming; a hand and forearm pressed 5 cm and more through
// it, lengthwise, so that at least a tenth of the triangles cross the hull's border. Paper's
// cameras.
CollisionScene curtain720();
// A dozen blocks on the table, a hand between them that touches some. The other scenes too have the
// four cameras around the table.
CollisionScene blocks();
// An assembly as from CAD, 50,000 triangles, a hand that reaches into it.
CollisionScene payload();
// A rippled sheet of a million triangles under a hand: 1 % of them nearer than kNear_m to the hull.
CollisionScene dense();
inline constexpr double kNear_m = 0.005;
// A plate of 80 triangles with legs of 6 cm, each pierced by a finger of its own: every triangle
// crosses the hull's border.
CollisionScene full();
// Fingers of 2 mm through triangles of 2 cm, seen by the same cameras with longer lenses: a map's
// pixel is 0.5 mm wide at the plate.
CollisionScene thin();
std::vector<CollisionScene> synthetic_scenes();

// seated4cam's maps, as `fivepipe maps` leaves them in a folder, against two chairs and a table of
// boxes. Throws std::runtime_error naming the file and what is wrong with it, or that the folder is
// another's.
CollisionScene real_scene(const std::filesystem::path& folder);

}  // namespace fivepipe::collision_bench
