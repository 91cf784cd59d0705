// Colours and textures of virtual objects, and their combination with the highlight of collisions.
#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "common/config/scene.h"
#include "common/gl/objects.h"
#include "render_node/materials/texture.h"

namespace fivepipe::render {

// Consecutive triangles of an object that are drawn together.
struct MaterialPart {
  std::size_t first_triangle, triangles;
  Eigen::Vector3d albedo;            // linear RGB
  const Texture* texture = nullptr;  // multiplies the albedo; null: none
};
// Returns the parts of an object with this many triangles, in mesh order. Triangles without a
// material have the object's colour. The textures must outlive the parts.
std::vector<MaterialPart> material_parts(const config::SceneObject& object, std::size_t triangles,
                                         const SceneTextures& textures);

// Returns the #define lines of the program (shaders/object.*) of a part, without those of shadows.
std::string material_features(const config::SceneObject& object, const MaterialPart& part);

// Sets the uniforms of that program, which is in use, and binds the texture to the unit. A
// colliding object is tinted red, also where it has a texture.
void set_material(const gl::GlProgram& program, const config::SceneObject& object,
                  const MaterialPart& part, bool is_colliding, int texture_unit);

// Linear RGB of an sRGB colour. Components are in 0 .. 1.
Eigen::Vector3d linear_from_srgb(const std::array<double, 3>& srgb);

}  // namespace fivepipe::render
