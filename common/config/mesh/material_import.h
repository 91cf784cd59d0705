// Takes the materials of an imported mesh file from Assimp's scene.
#pragma once
#include <assimp/scene.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/config/mesh/material.h"

namespace fivepipe::config {

// Collects the materials of one file. Call prepare(), then append() for each mesh of the scene
// whose nodes' transformations have been applied, then take().
class MaterialImport {
 public:
  // Takes the materials that triangles of the scene use. `file`: the mesh file.
  MaterialImport(const aiScene& scene, const std::filesystem::path& file);

  // Returns why the materials are unusable, or nullopt: a base colour outside 0 to 1, or a texture
  // whose file is absent, outside the folder of the mesh file, or unusable (image_header.h).
  const std::optional<std::string>& failure() const { return failure_; }
  bool has_materials() const { return !result_.materials.empty(); }

  // Leaves one set of texture coordinates in every mesh: that of its material's texture. All meshes
  // then have one vertex format, so that the order of the triangles does not depend on the sets.
  // Returns why a mesh with a texture is unusable: its coordinates are missing, not finite, or
  // larger than kMaxTextureCoordinate.
  std::optional<std::string> prepare(aiScene& scene) const;

  // Appends the triangles of the mesh: their material and texture coordinates.
  void append(const aiMesh& mesh);
  // Moves the materials out of this object, with `notes` appended to theirs.
  MeshMaterials take(std::vector<std::string> notes);

 private:
  struct Source {  // of one material of Assimp's scene
    std::uint32_t material = kNoMaterial;
    unsigned uv_set = 0;
  };

  void add(const aiScene& scene, unsigned index);
  std::optional<std::string> add_texture(const aiScene& scene, const aiMaterial& from,
                                         Material& material, unsigned& uv_set);
  std::optional<std::string> why_unusable(const aiScene& scene, const std::string& named,
                                          MaterialTexture& texture) const;
  const Material* material_of(const aiMesh& mesh) const;

  std::filesystem::path file_;
  bool is_gltf_;
  bool has_textures_ = false;
  std::vector<Source> sources_;
  MeshMaterials result_;
  std::optional<std::string> failure_;
};

}  // namespace fivepipe::config
