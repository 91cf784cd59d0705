#include "render_node/materials/material_parts.h"

#include "common/base/math/srgb.h"

namespace fivepipe::render {
namespace {

// The colour of a colliding object is this fraction of the way from its own colour to kHighlight.
// Colours are linear RGB.
constexpr double kHighlightStrength = 0.8;
const Eigen::Vector3d kHighlight(0.80, 0.02, 0.02);

}  // namespace

std::vector<MaterialPart> material_parts(const config::SceneObject& object, std::size_t triangles,
                                         const SceneTextures& textures) {
  const Eigen::Vector3d colour = linear_from_srgb(object.colour_rgb);
  const auto* const shape = std::get_if<config::MeshShape>(&object.shape);
  if (shape == nullptr || !shape->materials || shape->materials->runs.empty())
    return {{0, triangles, colour}};
  std::vector<MaterialPart> parts;
  std::size_t first = 0;
  for (const config::MaterialRun& run : shape->materials->runs) {
    MaterialPart part{first, run.triangles, colour};
    if (run.material != config::kNoMaterial) {
      const config::Material& material = shape->materials->materials[run.material];
      part.albedo = Eigen::Map<const Eigen::Vector3f>(material.base_rgb.data()).cast<double>();
      if (material.texture) part.texture = &textures.at(*material.texture);
    }
    parts.push_back(part);
    first += run.triangles;
  }
  return parts;
}

std::string material_features(const config::SceneObject& object, const MaterialPart& part) {
  // On a box every corner of a triangle has the normal of its face.
  const bool flat = std::holds_alternative<config::BoxShape>(object.shape);
  return std::string(flat ? "#define FLAT\n" : "") +
         (object.pattern == config::Pattern::checker ? "#define CHECKER\n" : "") +
         (object.warming ? "#define WARMED\n" : "") + (part.texture ? "#define TEXTURED\n" : "");
}

void set_material(const gl::GlProgram& program, const config::SceneObject& object,
                  const MaterialPart& part, bool is_colliding, int texture_unit) {
  Eigen::Vector3d albedo = part.albedo;
  if (part.texture) {
    part.texture->bind(texture_unit);
    program.set("base_colour", texture_unit);
    const Eigen::Vector3d added = (is_colliding ? kHighlightStrength : 0) * kHighlight;
    program.set("added_albedo", Eigen::Vector3f(added.cast<float>()));
    if (is_colliding) albedo *= 1 - kHighlightStrength;
  } else if (is_colliding) {
    albedo += kHighlightStrength * (kHighlight - albedo);
  }
  program.set("albedo", Eigen::Vector3f(albedo.cast<float>()));
  if (object.pattern == config::Pattern::checker)
    program.set("cells_per_m", float(1 / object.pattern_size_m));
  if (object.warming)
    program.set("warm_albedo",
                Eigen::Vector3f(linear_from_srgb(object.warming->colour_rgb).cast<float>()));
}

Eigen::Vector3d linear_from_srgb(const std::array<double, 3>& srgb) {
  return {base::linear_from_srgb(srgb[0]), base::linear_from_srgb(srgb[1]),
          base::linear_from_srgb(srgb[2])};
}

}  // namespace fivepipe::render
