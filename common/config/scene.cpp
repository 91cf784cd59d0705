#include "common/config/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/config/collision_requests_reader.h"
#include "common/config/mesh/mesh_file.h"
#include "common/config/objects/cloth_reader.h"
#include "common/config/objects/joint_reader.h"
#include "common/config/objects/lighting_reader.h"
#include "common/config/objects/overlay_reader.h"
#include "common/config/objects/particle_source_reader.h"
#include "common/config/objects/spacing_reader.h"
#include "common/config/read_files.h"
#include "common/config/yaml/yaml_reader.h"
#include "common/geometry/closed_mesh.h"
#include "common/geometry/oriented_box.h"

namespace fivepipe::config {

namespace {

constexpr Range kSize_m{0, 1e4, true};
constexpr Range kSubdivisions{0, 6};              // 20 * 4^6 = 81,920 triangles
constexpr Range kCurtainCellRange{1, 1000};       // at most 1e6 cells
constexpr std::size_t kMaxObjectNameLength = 64;  // bound of the name in messages
constexpr double kMaxBoxCells = 1e6;
// Boxes that only touch overlap by rounding.
constexpr double kTouching_m = 1e-6;

BoxShape read_box(YamlMap map) {
  const BoxShape box{map.vector3("size_m", kSize_m), map.number("cell_m", kSize_m, 0)};
  map.finish();
  if (!(box.cell_m > 0)) return box;
  const Eigen::Array3d cells = (box.size_m.array() / box.cell_m).ceil();
  if (!(2 * (cells.x() * cells.y() + cells.y() * cells.z() + cells.z() * cells.x()) <=
        kMaxBoxCells))
    map.problem_at("cell_m", "cell_m splits the box's faces into more than 1e6 cells: increase it");
  return box;
}

SphereShape read_sphere(YamlMap map) {
  const SphereShape sphere{map.number("radius_m", kSize_m),
                           map.integer("subdivisions", kSubdivisions, 2)};
  map.finish();
  return sphere;
}

CurtainShape read_curtain(YamlMap map) {
  const CurtainShape curtain{map.number("width_m", kSize_m),
                             map.number("height_m", kSize_m),
                             map.integer("columns", kCurtainCellRange),
                             map.integer("rows", kCurtainCellRange),
                             map.number("fold_depth_m", {0, 10}, 0),
                             map.number("fold_count", {0, 1000}, 0)};
  map.finish();
  return curtain;
}

// OBJ, STL and PLY carry no unit, so the scene must state one.
MeshShape read_mesh_shape(YamlMap map, Materials materials) {
  MeshShape shape;
  shape.file = map.path("file");
  const std::vector<std::pair<std::string, double>> units = {
      {"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}};
  if (map.has("unit") || !has_unit(shape.file)) shape.unit_m = map.choice<double>("unit", units);
  map.finish();
  if (shape.file.empty()) return shape;
  MeshOrReason mesh = read_mesh(shape.file, shape.unit_m, materials);
  if (!mesh.reason.empty())
    map.problem_at("file", "mesh " + shape.file.string() + ": " + mesh.reason);
  shape.mesh = std::move(mesh.mesh);
  shape.materials = std::move(mesh.materials);
  shape.files = std::move(mesh.files);
  return shape;
}

Shape read_shape(YamlMap& map) {
  std::vector<std::string> given;
  for (const std::string key : {"box", "sphere", "curtain", "mesh"})
    if (map.has(key)) given.push_back(key);
  if (given.size() > 1)
    map.problem_at(given[1],
                   given[0] + " and " + given[1] + " are both set: an object has one shape");
  if (given.empty()) {
    map.problem("the object has no shape: set box, sphere, curtain or mesh");
    return BoxShape{Eigen::Vector3d::Ones()};
  }
  if (given[0] == "box") return read_box(map.map("box"));
  if (given[0] == "sphere") return read_sphere(map.map("sphere"));
  if (given[0] == "curtain") return read_curtain(map.map("curtain"));
  // The object's own colour replaces the materials of the file.
  return read_mesh_shape(map.map("mesh"),
                         map.has("colour_rgb") ? Materials::without : Materials::with);
}

// Rotates about the world's x, then y, then z axis; then translates.
Eigen::Isometry3d read_placement(YamlMap& map) {
  const Eigen::Vector3d angles_rad =
      kDegree_rad * map.vector3("rotation_deg", kAny, Eigen::Vector3d::Zero());
  return Eigen::Translation3d(map.vector3("position_m", kAny)) *
         Eigen::AngleAxisd(angles_rad.z(), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(angles_rad.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(angles_rad.x(), Eigen::Vector3d::UnitX());
}

// has_shape: the shape was read without a problem.
ClothSettings read_cloth_of(YamlMap& map, const SceneObject& object, bool has_shape) {
  const bool is_curtain = std::holds_alternative<CurtainShape>(object.shape),
             is_mesh = std::holds_alternative<MeshShape>(object.shape);
  geometry::Mesh mesh;
  if (has_shape && (is_curtain || is_mesh)) {
    mesh = mesh_of(object);
    if (!check_cloth_mesh(map, is_curtain ? "curtain" : "mesh", mesh)) mesh = {};
  }
  return map.has("cloth") ? read_cloth(map.map("cloth"), mesh) : ClothSettings();
}

// A rigid body of this mesh touches the hull at its outside.
const geometry::Mesh* mesh_in_contact(const SceneObject& object) {
  const auto* shape = std::get_if<MeshShape>(&object.shape);
  return shape && object.reaction == Reaction::contact ? &shape->mesh : nullptr;
}

void check_outside(YamlMap& map, const SceneObject& object) {
  const geometry::Mesh* const mesh = mesh_in_contact(object);
  // Rounding gives a sheet of two equal sides a volume of either sign.
  constexpr double kNoVolume = 1e-9;  // of the cube of the diagonal
  if (mesh &&
      geometry::enclosed_volume_m3(*mesh) <
          -kNoVolume * std::pow(geometry::bounds_m(*mesh).diagonal().norm(), 3) &&
      geometry::open_edges(*mesh) == 0)
    map.problem_at("mesh",
                   "the mesh is inside out, and reaction contact needs its outside: flip its "
                   "triangles, so that each is counter-clockwise seen from outside");
}

// Rejects keys without effect, and combinations that cannot work.
void check_behaviour(YamlMap& map, const SceneObject& object) {
  const bool is_curtain = std::holds_alternative<CurtainShape>(object.shape),
             is_mesh = std::holds_alternative<MeshShape>(object.shape),
             is_dynamic = object.motion == Motion::dynamic,
             is_cloth = object.motion == Motion::cloth;
  if (is_curtain && is_dynamic)
    map.problem_at("motion",
                   "motion dynamic is for rigid objects: a curtain moves with motion cloth");
  if (is_cloth && !is_curtain && !is_mesh)
    map.problem_at("motion", "motion cloth needs a curtain or a mesh");
  if (!is_dynamic && object.reaction == Reaction::bounce)
    map.problem_at("reaction", "reaction bounce needs motion dynamic: only a rigid object bounces");
  if (!is_dynamic && object.reaction == Reaction::contact)
    map.problem_at("reaction",
                   "reaction contact needs motion dynamic: nothing else moves as a rigid body");
  if (!is_cloth && object.reaction == Reaction::yield)
    map.problem_at("reaction", "reaction yield needs motion cloth: only cloth yields to the hull");
  if (!is_cloth && map.has("cloth"))
    map.problem_at("cloth", "cloth has no effect without motion cloth");
  if (is_cloth && object.requests.first_contact)
    map.problem_at("report", "first_contact needs a rigid object: a cloth has no single pose");
  for (const std::string key :
       {"mass_kg", "restitution", "friction", "velocity_m_s", "hinge", "slider"})
    if (!is_dynamic && map.has(key))
      map.problem_at(key, key + " has no effect without motion dynamic");
  if (object.joint && object.reaction == Reaction::bounce)
    map.problem_at("reaction", "reaction bounce takes an object off its joint: use contact");
  if (object.reaction == Reaction::none && object.requests.any())
    map.problem_at("report", "report has no effect with reaction none: the object is not queried");
  if (object.pattern == Pattern::plain && map.has("pattern_size_m"))
    map.problem_at("pattern_size_m", "pattern_size_m has no effect on a plain object");
}

SceneObject read_object(YamlMap map) {
  SceneObject object;
  object.name = map.name("name", {}, kMaxObjectNameLength);
  object.location = map.location();
  const std::size_t problems_before_shape = map.problem_count();
  object.shape = read_shape(map);
  const bool has_shape = map.problem_count() == problems_before_shape;
  object.world_from_object = read_placement(map);
  object.motion = map.choice<Motion>(
      "motion", {{"fixed", Motion::fixed}, {"dynamic", Motion::dynamic}, {"cloth", Motion::cloth}},
      Motion::fixed);
  const bool is_cloth = object.motion == Motion::cloth;
  object.reaction = map.choice<Reaction>("reaction",
                                         {{"none", Reaction::none},
                                          {"highlight", Reaction::highlight},
                                          {"bounce", Reaction::bounce},
                                          {"contact", Reaction::contact},
                                          {"yield", Reaction::yield}},
                                         is_cloth ? Reaction::yield : Reaction::highlight);
  if (is_cloth) object.cloth = read_cloth_of(map, object, has_shape);
  object.mass_kg = map.number("mass_kg", {0, 1e6, true}, object.mass_kg);
  object.restitution = map.number("restitution", kUnitRange, object.restitution);
  object.friction = map.number("friction", {0, 10}, object.friction);
  object.velocity_world_m_s = map.vector3("velocity_m_s", {-100, 100}, object.velocity_world_m_s);
  object.joint = read_joint(map);
  object.spacing = read_spacing(map, object.motion == Motion::fixed);
  object.colour_rgb = map.rgb("colour_rgb", object.colour_rgb);
  object.pattern = map.choice<Pattern>(
      "pattern", {{"plain", Pattern::plain}, {"checker", Pattern::checker}}, Pattern::plain);
  object.pattern_size_m = map.number("pattern_size_m", kSize_m, object.pattern_size_m);
  if (map.has("report")) object.requests = read_collision_requests(map.map("report"));
  if (map.has("warmth")) object.warming = read_warming(map.map("warmth"));
  check_behaviour(map, object);
  check_outside(map, object);
  map.finish();
  return object;
}

std::optional<geometry::OrientedBox> box_of(const SceneObject& object) {
  const auto* box = std::get_if<BoxShape>(&object.shape);
  if (!box) return std::nullopt;
  return geometry::OrientedBox{object.world_from_object, 0.5 * box->size_m};
}

// Reports each jointed box that overlaps a fixed box of the scene at the start, at its joint's key:
// it could not move. sim_node checks the other shapes. `maps`: the mappings of the scene's objects,
// in their order.
void check_clearance(const Scene& scene, const std::vector<YamlMap>& maps) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& moving = scene.objects[i];
    const auto moving_box = box_of(moving);
    if (moving.motion != Motion::dynamic || !moving.joint || !moving_box) continue;
    for (const SceneObject& fixed : scene.objects) {
      const auto fixed_box = box_of(fixed);
      if (fixed.motion != Motion::fixed || !fixed_box) continue;
      const double overlap_m = geometry::overlap_m(*moving_box, *fixed_box);
      if (overlap_m > kTouching_m)
        maps[i].problem_at(
            moving.joint->kind == JointKind::hinge ? "hinge" : "slider",
            fmt::format("{} overlaps {} by {:.6g} m at the start and could not move: leave a "
                        "clearance between them",
                        moving.name, fixed.name, overlap_m));
    }
  }
}

// Reports a name that an object or a source before has.
class NamesInScene {
 public:
  // what: "object" or "source".
  void add(YamlMap& map, const std::string& what, const std::string& name) {
    const auto [first, is_new] = line_of_name_.try_emplace(name, map.location_of("name").line);
    if (!is_new && !name.empty())
      map.problem_at(
          "name", fmt::format("{} name {} is already used in line {}", what, name, first->second));
  }

 private:
  std::map<std::string, int> line_of_name_;
};

}  // namespace

Scene read_scene(const std::filesystem::path& file, Problems& problems) {
  YamlMap map = YamlMap::load(file, problems);
  Scene scene;
  if (map.is_void()) return scene;
  scene.name = map.name("name");
  scene.file = file;
  scene.gravity_m_s2 = map.number("gravity_m_s2", {0, 1000}, scene.gravity_m_s2);
  scene.light_world_m = map.vector3("light_m", kAny, scene.light_world_m);
  scene.lights_real_objects = map.flag("lights_real_objects", false);
  if (map.has("shadows")) scene.shadows = read_shadows(map.map("shadows"), scene.light_world_m);
  scene.background_rgb = map.rgb("background_rgb", scene.background_rgb);
  if (map.has("history")) scene.history = read_history_requests(map.map("history"));
  NamesInScene names;
  std::vector<YamlMap> object_maps = map.maps("objects");
  for (YamlMap& object_map : object_maps) {
    scene.objects.push_back(read_object(object_map));
    names.add(object_map, "object", scene.objects.back().name);
    if (scene.objects.back().requests.first_contact && !scene.history)
      object_map.problem_at("report",
                            "first_contact compares two frames: add `history: {}` to the scene");
  }
  if (map.has("particles"))
    for (YamlMap& source_map : map.maps("particles")) {
      scene.particles.push_back(read_particle_source(source_map));
      names.add(source_map, "source", scene.particles.back().name);
    }
  check_clearance(scene, object_maps);
  scene.overlays = read_overlays(map, [&](Overlay overlay) {
    return std::any_of(scene.objects.begin(), scene.objects.end(),
                       [&](const SceneObject& object) { return reports(object, overlay); });
  });
  map.finish();
  return scene;
}

bool is_reported(const SceneObject& object) {
  // Rigid contact needs no report: its contacts are detected in the steps.
  return object.reaction == Reaction::contact ? object.requests.any()
                                              : object.reaction != Reaction::none;
}

bool reports(const SceneObject& object, Overlay overlay) {
  if (!is_reported(object)) return false;
  const std::optional<ResponseRequests>& response = object.requests.response;
  switch (overlay) {
    case Overlay::collision_points: return true;
    case Overlay::recovery: return response || object.reaction == Reaction::bounce;
    case Overlay::hull_normals: return response && (response->four_points || response->closed_form);
    case Overlay::proximity: return object.requests.proximity.has_value();
  }
  return false;
}

std::vector<std::string> mesh_warnings(const Scene& scene, const Eigen::AlignedBox3d& volume_m) {
  constexpr double kCmPerM = 100;
  const double max_size_m =
      volume_m.isEmpty()
          ? kMaxPlausibleSize_m
          : std::min(kMaxPlausibleSize_m, kMaxPlausibleDiagonals * volume_m.diagonal().norm());
  std::vector<std::string> warnings;
  for (const SceneObject& object : scene.objects) {
    const auto* shape = std::get_if<MeshShape>(&object.shape);
    if (shape == nullptr) continue;
    const Eigen::Vector3d size_m = geometry::bounds_m(shape->mesh).sizes();
    if (!(size_m.maxCoeff() >= kMinPlausibleSize_m && size_m.maxCoeff() <= max_size_m))
      warnings.push_back(fmt::format(
          "object {} is {:.6g} x {:.6g} x {:.6g} cm: check the unit of {}", object.name,
          kCmPerM * size_m.x(), kCmPerM * size_m.y(), kCmPerM * size_m.z(), shape->file.string()));
    const geometry::Mesh* const mesh = mesh_in_contact(object);
    if (const std::size_t open = mesh ? geometry::open_edges(*mesh) : 0; open > 0)
      warnings.push_back(fmt::format(
          "object {}: mesh {} is not closed ({} open edges); reaction contact treats the "
          "counter-clockwise side of each triangle as outside: close the mesh",
          object.name, shape->file.string(), open));
  }
  return warnings;
}

bool has_spacings(const Scene& scene) {
  return std::any_of(scene.objects.begin(), scene.objects.end(),
                     [](const SceneObject& object) { return object.spacing.has_value(); });
}

bool moves_objects(const Scene& scene) {
  return !scene.particles.empty() ||
         std::any_of(scene.objects.begin(), scene.objects.end(),
                     [](const SceneObject& object) { return object.motion != Motion::fixed; });
}

std::vector<std::string> material_warnings(const Scene& scene) {
  std::vector<std::string> warnings;
  for (const SceneObject& object : scene.objects)
    if (const auto* shape = std::get_if<MeshShape>(&object.shape); shape && shape->materials)
      for (const std::string& note : shape->materials->notes)
        warnings.push_back(
            fmt::format("object {}, mesh {}: {}", object.name, shape->file.string(), note));
  return warnings;
}

geometry::Mesh mesh_of(const SceneObject& object) {
  struct Mesher {
    geometry::Mesh operator()(const BoxShape& s) const {
      return geometry::box_mesh(s.size_m, s.cell_m);
    }
    geometry::Mesh operator()(const SphereShape& s) const {
      return geometry::sphere_mesh(s.radius_m, s.subdivisions);
    }
    geometry::Mesh operator()(const CurtainShape& s) const {
      return geometry::curtain_mesh(s.width_m, s.height_m, s.columns, s.rows, s.fold_depth_m,
                                    s.fold_count);
    }
    geometry::Mesh operator()(const MeshShape& s) const { return s.mesh; }
  };
  return std::visit(Mesher{}, object.shape);
}

}  // namespace fivepipe::config
