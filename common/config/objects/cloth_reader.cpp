#include "common/config/objects/cloth_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace fivepipe::config {
namespace {

constexpr Range kDensity_kg_m2{1e-3, 100};
constexpr Range kCompliance{0, 1e9};
constexpr Range kDamping_s{0, 10};
constexpr Range kAirDrag_1_s{0, 1000};
constexpr Range kThickness_m{0, 0.1};
constexpr Range kFriction{0, 10};
constexpr std::size_t kMaxPins = 64;

ClothPin read_pin(YamlMap map, const geometry::Mesh& mesh) {
  const std::size_t problems_before = map.problem_count();
  const Eigen::Vector3d from_m = map.vector3("from_m", kAny), to_m = map.vector3("to_m", kAny);
  ClothPin pin{{from_m.cwiseMin(to_m), from_m.cwiseMax(to_m)}, map.direction("slides_along")};
  map.finish();
  const bool holds_a_vertex =
      std::any_of(mesh.vertices_m.begin(), mesh.vertices_m.end(),
                  [&](const Eigen::Vector3d& p) { return pin.box_m.contains(p); });
  if (!holds_a_vertex && !mesh.vertices_m.empty() && map.problem_count() == problems_before) {
    // Adding 0 turns -0 into 0.
    const Eigen::AlignedBox3d bounds_m =
        geometry::bounds_m(mesh).translated(Eigen::Vector3d::Zero());
    map.problem(fmt::format(
        "the pin holds no vertex: from_m and to_m are in the object's frame, in which the cloth "
        "extends from [{:.6g}, {:.6g}, {:.6g}] to [{:.6g}, {:.6g}, {:.6g}]",
        bounds_m.min().x(), bounds_m.min().y(), bounds_m.min().z(), bounds_m.max().x(),
        bounds_m.max().y(), bounds_m.max().z()));
  }
  return pin;
}

}  // namespace

bool check_cloth_mesh(const YamlMap& object, const std::string& key, const geometry::Mesh& mesh) {
  if (mesh.triangles.size() > kMaxClothTriangles) {
    object.problem_at(key, fmt::format("the cloth has {} triangles, at most {} can be simulated: "
                                       "use a coarser mesh",
                                       mesh.triangles.size(), kMaxClothTriangles));
    return false;
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Eigen::Vector3d &p = mesh.vertices_m[a], &q = mesh.vertices_m[b], &r = mesh.vertices_m[c];
    const double longest_sq =
        std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()});
    if ((q - p).cross(r - p).norm() > kMinClothShape * longest_sq) continue;
    // One is enough to find the mesh's error.
    object.problem_at(
        key, fmt::format("triangle {} of the cloth has no area: its corners are [{:.6g}, "
                         "{:.6g}, {:.6g}], [{:.6g}, {:.6g}, {:.6g}] and [{:.6g}, "
                         "{:.6g}, {:.6g}] m; remove it from the mesh",
                         i, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), r.x(), r.y(), r.z()));
    return false;
  }
  return true;
}

ClothSettings read_cloth(YamlMap map, const geometry::Mesh& mesh) {
  ClothSettings cloth;
  const auto number = [&](const char* key, Range range, double& value) {
    value = map.number(key, range, value);
  };
  number("density_kg_m2", kDensity_kg_m2, cloth.density_kg_m2);
  number("stretch_compliance_m_n", kCompliance, cloth.stretch_compliance_m_n);
  number("compression_compliance_m_n", kCompliance, cloth.compression_compliance_m_n);
  number("shear_compliance_m_n", kCompliance, cloth.shear_compliance_m_n);
  number("bending_compliance_1_nm", kCompliance, cloth.bending_compliance_1_nm);
  number("damping_s", kDamping_s, cloth.damping_s);
  number("air_drag_1_s", kAirDrag_1_s, cloth.air_drag_1_s);
  number("thickness_m", kThickness_m, cloth.thickness_m);
  number("friction", kFriction, cloth.friction);
  cloth.self_collision = map.flag("self_collision", cloth.self_collision);
  cloth.object_collision = map.flag("object_collision", cloth.object_collision);
  cloth.v_rec_world = map.direction("v_rec");
  if (map.has("pins")) {
    const std::vector<YamlMap> pins = map.maps("pins");
    if (pins.size() > kMaxPins)
      map.problem_at("pins", fmt::format("pins has {} boxes, at most {} are possible: one box may "
                                         "hold many vertices",
                                         pins.size(), kMaxPins));
    else
      for (const YamlMap& pin : pins) cloth.pins.push_back(read_pin(pin, mesh));
  }
  map.finish();
  return cloth;
}

}  // namespace fivepipe::config
