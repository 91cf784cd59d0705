// The virtual scene: the objects to draw, their motion and their reaction to real objects. Read
// from a scene file.
#pragma once
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/config/collision_requests.h"
#include "common/config/mesh/material.h"
#include "common/config/objects/cloth_settings.h"
#include "common/config/objects/joint.h"
#include "common/config/objects/lighting.h"
#include "common/config/objects/overlay.h"
#include "common/config/objects/particle_source.h"
#include "common/config/objects/spacing.h"
#include "common/config/yaml/problems.h"
#include "common/geometry/mesh.h"

namespace fivepipe::config {

struct BoxShape {
  Eigen::Vector3d size_m;
  double cell_m = 0;  // maximum size of the cells into which each face is divided; 0: one cell
};
struct SphereShape {
  double radius_m;
  int subdivisions = 2;  // of an icosahedron: 20 * 4^subdivisions triangles
};
// A folded sheet: geometry::curtain_mesh().
struct CurtainShape {
  double width_m, height_m;
  int columns, rows;                // of cells, two triangles each
  double fold_depth_m, fold_count;  // amplitude and number of the sinusoidal folds
};
struct MeshShape {
  std::filesystem::path file;
  std::optional<double> unit_m;  // size of the file's unit; absent: that of the format
  geometry::Mesh mesh;           // the loaded file, vertices in metres
  // Null if the file has none, or if the object has a colour_rgb, which replaces them.
  std::shared_ptr<const MeshMaterials> materials = {};
  // The files that the mesh file names and that were read, without textures.
  std::vector<std::filesystem::path> files = {};
};
using Shape = std::variant<BoxShape, SphereShape, CurtainShape, MeshShape>;

// fixed: does not move, unless its spacing changes; dynamic: a rigid body under gravity; cloth:
// deforms under gravity.
enum class Motion { fixed, dynamic, cloth };
// Reaction of an object to the hull. none: no collision query; highlight: drawn red while it
// collides; bounce: moved out of the hull and reflected, as in the paper; contact: a rigid body in
// contact with the hull, with friction; yield: a cloth that leaves the hull.
enum class Reaction { none, highlight, bounce, contact, yield };
enum class Pattern { plain, checker };

struct SceneObject {
  std::string name;              // unique in the scene
  SourceLocation location = {};  // in the scene file
  Shape shape;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();  // initial pose
  Motion motion = Motion::fixed;
  Reaction reaction = Reaction::highlight;
  double mass_kg = 1.0, restitution = 0.5;  // dynamic objects only
  // Dynamic objects only. Coulomb coefficient against the hull; two objects have the product of
  // theirs.
  double friction = 0.5;
  Eigen::Vector3d velocity_world_m_s = Eigen::Vector3d::Zero();  // at the start; dynamic only
  std::optional<Joint> joint = {};                     // dynamic only; absent: moves freely
  std::optional<Spacing> spacing = {};                 // fixed only; absent: nothing moves it
  std::optional<ClothSettings> cloth = {};             // cloth only
  std::array<double, 3> colour_rgb = {0.8, 0.8, 0.8};  // 0 to 1, sRGB
  Pattern pattern = Pattern::plain;
  double pattern_size_m = 0.1;          // edge of a checker square
  CollisionRequests requests = {};      // outputs of its collision results
  std::optional<Warming> warming = {};  // absent: real objects do not warm it
};

struct Scene {
  std::string name;
  std::filesystem::path file;
  double gravity_m_s2 = 9.80665;  // along -z
  Eigen::Vector3d light_world_m = {0, 0, 3};
  // Whether the light lights real objects. Otherwise they have the colours of their images.
  bool lights_real_objects = false;
  std::optional<ShadowView> shadows = {};                    // absent: nothing casts shadows
  std::array<double, 3> background_rgb = {0.1, 0.12, 0.15};  // 0 to 1, sRGB
  std::vector<SceneObject> objects;
  std::vector<ParticleSource> particles = {};
  std::optional<HistoryRequests> history = {};  // absent: hull components are not tracked
  std::set<Overlay> overlays = {};              // each shows something of at least one object
};

// Returns true if sim_node sends a collision result of the object in every frame.
bool is_reported(const SceneObject& object);
// Returns true if the object's collision results contain what the overlay shows.
bool reports(const SceneObject& object, Overlay overlay);

// Returns the object's surface in its own frame [m].
geometry::Mesh mesh_of(const SceneObject& object);

// Returns true if an experimenter may move an object of the scene.
bool has_spacings(const Scene& scene);

// Returns true if the scene has a dynamic object, a cloth or particles.
bool moves_objects(const Scene& scene);

// Returns one line for each mesh that is usable but probably wrong: larger than kMaxPlausibleSize_m
// or than kMaxPlausibleDiagonals of the rig's volume, or smaller than kMinPlausibleSize_m, as with
// another unit; or with reaction contact and not closed. volume_m: empty if it is not known.
std::vector<std::string> mesh_warnings(const Scene& scene,
                                       const Eigen::AlignedBox3d& volume_m = {});
// Returns one line for each part of a mesh's materials that is drawn in another way than its file
// states (MeshMaterials::notes).
std::vector<std::string> material_warnings(const Scene& scene);
// The size of a hall, and of a 2 cm part whose millimetres were read as metres.
inline constexpr double kMaxPlausibleSize_m = 20.0;
// A room is larger than the volume in it; a part is not.
inline constexpr double kMaxPlausibleDiagonals = 2.0;
// About two pixels of a camera, and the size of a 5 m part whose metres were read as millimetres.
inline constexpr double kMinPlausibleSize_m = 0.005;

}  // namespace fivepipe::config
