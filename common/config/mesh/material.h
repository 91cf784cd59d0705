// Base colours and textures of a mesh file's materials.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace fivepipe::config {

// Colours outside the texture's unit square: those of the repeated texture, of its mirror image, or
// of its edge.
enum class Wrap { repeat, mirror, clamp };

// A texture with sRGB colours. The image is a PNG or JPEG file beside the mesh file, or inside it.
struct MaterialTexture {
  std::filesystem::path file;  // the image, or the mesh file that contains it
  int embedded = -1;           // index of the image in the mesh file; -1: `file` is the image
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;

  bool operator==(const MaterialTexture&) const = default;
  bool operator<(const MaterialTexture& other) const {
    return std::tie(file, embedded, wrap_u, wrap_v) <
           std::tie(other.file, other.embedded, other.wrap_u, other.wrap_v);
  }
};
// Returns "FILE", or "image 2 in FILE".
std::string name_of(const MaterialTexture& texture);

struct Material {
  std::string name;               // as in the file; may be empty
  std::array<float, 3> base_rgb;  // 0 to 1, linear; the texture's colours are multiplied by it
  std::optional<MaterialTexture> texture = {};

  bool operator==(const Material&) const = default;
};
inline constexpr std::uint32_t kNoMaterial = UINT32_MAX;

// Consecutive triangles of one material.
struct MaterialRun {
  std::uint32_t triangles;
  std::uint32_t material;  // index of the material, or kNoMaterial

  bool operator==(const MaterialRun&) const = default;
};

struct MeshMaterials {
  std::vector<Material> materials = {};
  // Of all triangles in mesh order; empty: the mesh has no material.
  std::vector<MaterialRun> runs = {};
  // Texture coordinates by corner, three corners per triangle in mesh order: (0, 0) is the top left
  // corner of the image, (1, 1) its bottom right one. Empty if no material has a texture.
  std::vector<std::array<float, 2>> corners_uv = {};
  std::vector<std::string> notes = {};  // differences between the drawing and the file, for users

  bool operator==(const MeshMaterials&) const = default;
};

// Beyond this, floats are more than a texel of a 16-pixel texture apart.
inline constexpr float kMaxTextureCoordinate = 1e6f;

}  // namespace fivepipe::config
