// The virtual scene: what is drawn, what is simulated, what reacts to real objects.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/config/collision_requests.h"
#include "common/geometry/mesh.h"

namespace fivepipe::config {

struct BoxShape {
  Eigen::Vector3d size_m;
  double cell_m = 0;
};  // cell_m: faces are divided into cells no larger; 0: into none
struct SphereShape {
  double radius_m;
  int subdivisions = 2;
};
struct CurtainShape {
  double width_m, height_m;
  int columns, rows;
  double fold_depth_m, fold_count;
};
struct MeshShape {
  std::filesystem::path file;
  double unit_m;
  geometry::Mesh mesh;
};  // loaded; vertices already in metres
using Shape = std::variant<BoxShape, SphereShape, CurtainShape, MeshShape>;

// fixed: stays where it is; dynamic: a rigid body under gravity.
enum class Motion { fixed, dynamic };
// What an object does about the hull. none: it is not even queried; highlight: drawn red while
// colliding; bounce: moved out and reflected.
enum class Reaction { none, highlight, bounce };
enum class Pattern { plain, checker };

struct SceneObject {
  std::string name;  // unique in the scene
  Shape shape;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();  // at the start
  Motion motion = Motion::fixed;
  Reaction reaction = Reaction::highlight;
  double mass_kg = 1.0, restitution = 0.5;             // dynamic objects only
  std::array<double, 3> colour_rgb = {0.8, 0.8, 0.8};  // 0..1, sRGB
  Pattern pattern = Pattern::plain;
  double pattern_size_m = 0.1;          // edge of a checker field
  CollisionRequests requests = {};      // what its collision results tell
  std::optional<Warming> warming = {};  // it is warmed by real objects
};

struct Scene {
  std::string name;
  double gravity_m_s2 = 9.80665;  // along -z
  Eigen::Vector3d light_world_m = {0, 0, 3};
  std::array<double, 3> background_rgb = {0.1, 0.12, 0.15};
  std::vector<SceneObject> objects;
  std::optional<HistoryRequests> history =
      {};  // nothing is kept from frame to frame unless asked for
};

// The object's surface in its own frame.
geometry::Mesh mesh_of(const SceneObject& object);

// Meshes that are probably in another unit than stated: larger than kMaxPlausibleSize_m or smaller
// than kMinPlausibleSize_m, one line each with the size in cm. Nothing is wrong with them
// otherwise.
std::vector<std::string> mesh_size_warnings(const Scene& scene);
inline constexpr double kMaxPlausibleSize_m = 50.0;  // a hall; a 5 cm part whose mm are taken for m
inline constexpr double kMinPlausibleSize_m =
    0.0005;  // below a camera's resolution; a 0.5 m part whose m are taken for mm

// Throws ConfigError listing every problem of the file, mesh files included.
Scene load_scene(const std::filesystem::path& file);

}  // namespace fivepipe::config
