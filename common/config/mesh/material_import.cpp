#include "common/config/mesh/material_import.h"

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <memory>
#include <set>
#include <string_view>

#include "common/base/math/srgb.h"
#include "common/base/readable_file.h"
#include "common/config/mesh/image_header.h"
#include "common/config/mesh/mesh_file.h"

namespace fivepipe::config {

namespace {

namespace fs = std::filesystem;

// The header of an image is in its first bytes. A JPEG file may have a longer preview before its
// size; the renderer then checks the size.
constexpr std::size_t kHeaderBytes = 1 << 16;

bool has_triangles(const aiMesh& mesh) {
  return mesh.mNumVertices > 0 &&
         (mesh.mPrimitiveTypes & (aiPrimitiveType_TRIANGLE | aiPrimitiveType_POLYGON)) != 0;
}

// Replaces %20 and the like (RFC 3986, section 2.1).
std::string percent_decoded(const std::string& uri) {
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned char byte = 0;
    const char* const digits = uri.data() + i + 1;
    if (uri[i] == '%' && i + 2 < uri.size() &&
        std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
      path += char(byte);
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
}

Wrap wrap_of(aiTextureMapMode mode) {
  switch (mode) {
    case aiTextureMapMode_Mirror: return Wrap::mirror;
    case aiTextureMapMode_Clamp:
    case aiTextureMapMode_Decal: return Wrap::clamp;
    default: return Wrap::repeat;
  }
}

// Returns the base colour: linear in glTF; of OBJ the diffuse colour, which is sRGB as colour_rgb.
std::optional<aiColor3D> base_colour(const aiMaterial& from, bool is_gltf) {
  aiColor4D colour;
  if (is_gltf) {
    if (from.Get(AI_MATKEY_BASE_COLOR, colour) != aiReturn_SUCCESS) return std::nullopt;
  } else if (from.Get(AI_MATKEY_COLOR_DIFFUSE, colour) != aiReturn_SUCCESS) {
    return std::nullopt;
  }
  return aiColor3D(colour.r, colour.g, colour.b);
}

bool is_transparent(const aiMaterial& from, bool is_gltf) {
  aiString alpha_mode;
  if (is_gltf)
    return from.Get(AI_MATKEY_GLTF_ALPHAMODE, alpha_mode) == aiReturn_SUCCESS &&
           std::string_view(alpha_mode.C_Str()) != "OPAQUE";
  float opacity = 1;
  return from.Get(AI_MATKEY_OPACITY, opacity) == aiReturn_SUCCESS && opacity < 1;
}

std::string beginning_of(const fs::path& file) {
  std::string bytes(kHeaderBytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(std::size_t(in.gcount()));
  return bytes;
}

std::optional<std::string> why_unusable_file(const fs::path& file) {
  if (const auto why = base::why_unreadable(file)) return why;
  std::error_code error;  // file_size() then returns the largest number
  const std::uintmax_t file_bytes = fs::file_size(file, error);
  if (file_bytes > kMaxImageBytes) return "the image file is larger than 256 MiB";
  return why_no_texture(beginning_of(file), file_bytes <= kHeaderBytes);
}

std::optional<std::string> why_unusable_embedded(const aiScene& scene, unsigned index) {
  if (index >= scene.mNumTextures) return "there is no such image";
  const aiTexture& image = *scene.mTextures[index];
  if (image.mHeight != 0 || image.pcData == nullptr) return "it is neither a PNG nor a JPEG image";
  if (image.mWidth > kMaxImageBytes) return "the image is larger than 256 MiB";
  return why_no_texture({reinterpret_cast<const char*>(image.pcData), image.mWidth}, true);
}

}  // namespace

MaterialImport::MaterialImport(const aiScene& scene, const fs::path& file)
    : file_(file), is_gltf_(is_gltf(file)), sources_(scene.mNumMaterials) {
  std::set<unsigned> used;
  for (unsigned i = 0; i < scene.mNumMeshes; ++i)
    if (has_triangles(*scene.mMeshes[i])) used.insert(scene.mMeshes[i]->mMaterialIndex);
  for (const unsigned index : used)
    if (index < scene.mNumMaterials && !failure_) add(scene, index);
}

void MaterialImport::add(const aiScene& scene, unsigned index) {
  const aiMaterial& from = *scene.mMaterials[index];
  // Assimp adds a material for the meshes without one: to glTF as the last one.
  if (is_gltf_ ? index + 1 == scene.mNumMaterials
               : std::string_view(from.GetName().C_Str()) == AI_DEFAULT_MATERIAL_NAME)
    return;
  const auto colour = base_colour(from, is_gltf_);
  if (!colour) return;
  Material material{from.GetName().C_Str(), {colour->r, colour->g, colour->b}};
  for (float& c : material.base_rgb) {
    if (!(c >= 0 && c <= 1)) {
      failure_ = "material '" + material.name + "': its base colour is not between 0 and 1";
      return;
    }
    if (!is_gltf_) c = float(base::linear_from_srgb(c));
  }
  if (const auto why = add_texture(scene, from, material, sources_[index].uv_set)) {
    failure_ = "material '" + material.name + "': " + *why;
    return;
  }
  if (is_transparent(from, is_gltf_))
    result_.notes.push_back("material '" + material.name +
                            "' is transparent in the file; it is drawn opaque");
  sources_[index].material = std::uint32_t(result_.materials.size());
  result_.materials.push_back(std::move(material));
}

std::optional<std::string> MaterialImport::add_texture(const aiScene& scene, const aiMaterial& from,
                                                       Material& material, unsigned& uv_set) {
  const aiTextureType type = is_gltf_ ? aiTextureType_BASE_COLOR : aiTextureType_DIFFUSE;
  if (from.GetTextureCount(type) == 0) return std::nullopt;
  aiString path;
  std::array<aiTextureMapMode, 3> modes{};  // repeat, unless the file states another one
  if (from.GetTexture(type, 0, &path, nullptr, &uv_set, nullptr, nullptr, modes.data()) !=
      aiReturn_SUCCESS)
    return "its texture has no file";
  MaterialTexture texture{file_, -1, wrap_of(modes[0]), wrap_of(modes[1])};
  const std::string named(path.C_Str());
  if (const auto why = why_unusable(scene, named, texture))
    return "texture " + (texture.embedded >= 0 ? name_of(texture) : named) + ": " + *why;
  material.texture = std::move(texture);
  has_textures_ = true;
  return std::nullopt;
}

// Sets the file and the index of the texture from its name in Assimp's scene: "*2" is an image
// inside the mesh file.
std::optional<std::string> MaterialImport::why_unusable(const aiScene& scene,
                                                        const std::string& named,
                                                        MaterialTexture& texture) const {
  if (named.starts_with('*')) {
    int index = -1;
    std::from_chars(named.data() + 1, named.data() + named.size(), index);
    if (index < 0) return "there is no such image";
    texture.embedded = index;
    return why_unusable_embedded(scene, unsigned(index));
  }
  std::string local = is_gltf_ ? percent_decoded(named) : named;
  if (!is_gltf_) std::replace(local.begin(), local.end(), '\\', '/');
  const fs::path relative = fs::path(local).lexically_normal();
  if (relative.empty() || !relative.has_filename()) return "there is no such file";
  if (relative.is_absolute() || *relative.begin() == "..")
    return "the file is outside the folder of the mesh file: move it there";
  texture.file = file_.parent_path() / relative;
  return why_unusable_file(texture.file);
}

const Material* MaterialImport::material_of(const aiMesh& mesh) const {
  const std::uint32_t index =
      mesh.mMaterialIndex < sources_.size() ? sources_[mesh.mMaterialIndex].material : kNoMaterial;
  return index == kNoMaterial ? nullptr : &result_.materials[index];
}

std::optional<std::string> MaterialImport::prepare(aiScene& scene) const {
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    aiMesh& mesh = *scene.mMeshes[i];
    auto uv = std::make_unique<aiVector3D[]>(mesh.mNumVertices);  // zero
    if (const Material* material = material_of(mesh);
        material != nullptr && material->texture && has_triangles(mesh)) {
      const unsigned set = sources_[mesh.mMaterialIndex].uv_set;
      const std::string name = "material '" + material->name + "': ";
      if (set >= AI_MAX_NUMBER_OF_TEXTURECOORDS || !mesh.HasTextureCoords(set))
        return name + "it has a texture, but a part of the mesh with it has no texture coordinates";
      std::copy_n(mesh.mTextureCoords[set], mesh.mNumVertices, uv.get());
      for (unsigned v = 0; v < mesh.mNumVertices; ++v)
        if (!(std::abs(uv[v].x) <= kMaxTextureCoordinate &&
              std::abs(1 - uv[v].y) <= kMaxTextureCoordinate))  // as in append()
          return name + "a texture coordinate is not finite, or beyond 1e6";
    }
    for (unsigned set = 0; set < AI_MAX_NUMBER_OF_TEXTURECOORDS; ++set) {
      delete[] mesh.mTextureCoords[set];
      mesh.mTextureCoords[set] = nullptr;
      mesh.mNumUVComponents[set] = 0;
    }
    mesh.mTextureCoords[0] = uv.release();  // the mesh deletes it
    mesh.mNumUVComponents[0] = 2;
  }
  return std::nullopt;
}

void MaterialImport::append(const aiMesh& mesh) {
  std::uint32_t triangles = 0;
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;
    ++triangles;
    if (!has_textures_) continue;
    for (unsigned corner = 0; corner < 3; ++corner) {
      const aiVector3D uv =
          mesh.HasTextureCoords(0) ? mesh.mTextureCoords[0][face.mIndices[corner]] : aiVector3D();
      result_.corners_uv.push_back({uv.x, 1 - uv.y});  // Assimp's v counts from the bottom
    }
  }
  const Material* material = material_of(mesh);
  const std::uint32_t index =
      material == nullptr ? kNoMaterial : std::uint32_t(material - result_.materials.data());
  if (!result_.runs.empty() && result_.runs.back().material == index)
    result_.runs.back().triangles += triangles;
  else
    result_.runs.push_back({triangles, index});
}

MeshMaterials MaterialImport::take(std::vector<std::string> notes) {
  result_.notes.insert(result_.notes.end(), notes.begin(), notes.end());
  return std::move(result_);
}

}  // namespace fivepipe::config
