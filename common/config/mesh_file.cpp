#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/DefaultIOSystem.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <optional>

#include "common/base/readable_file.h"
#include "common/config/read_files.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

namespace {

// Returns the index of the first vertex that is not finite, counted over all meshes.
std::optional<std::size_t> not_finite_vertex(const aiScene& scene) {
  std::size_t count = 0;
  for (unsigned i = 0; i < scene.mNumMeshes; ++i)
    for (unsigned j = 0; j < scene.mMeshes[i]->mNumVertices; ++j, ++count) {
      const aiVector3D& v = scene.mMeshes[i]->mVertices[j];
      if (!(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z))) return count;
    }
  return std::nullopt;
}

// Keeps positions only, so that equal corners become one vertex even if their normals or texture
// coordinates differ.
const aiScene* simplified(Assimp::Importer& importer) {
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                  aiComponent_COLORS | aiComponent_TEXCOORDS |
                                  aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  return importer.ApplyPostProcessing(aiProcess_RemoveComponent | aiProcess_Triangulate |
                                      aiProcess_SortByPType | aiProcess_PreTransformVertices |
                                      aiProcess_JoinIdenticalVertices);
}

void append(geometry::Mesh& mesh, const aiMesh& part, double unit_m,
            bool y_is_up) {  // true for glTF (glTF 2.0, section 3.4)
  const auto first = std::uint32_t(mesh.vertices_m.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    mesh.vertices_m.push_back(
        unit_m * (y_is_up ? Eigen::Vector3d(v.x, -v.z, v.y) : Eigen::Vector3d(v.x, v.y, v.z)));
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i)
    if (const aiFace& face = part.mFaces[i]; face.mNumIndices == 3)
      mesh.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
}

// Returns the file name's extension in lower case, with its dot.
std::string mesh_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

// An OBJ file names material files and a glTF file names buffers. Refuses those that are no regular
// files, of which a pipe would keep the reader waiting.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override { return !base::why_unreadable(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return base::why_unreadable(file) ? nullptr : DefaultIOSystem::Open(file, mode);
  }
};

}  // namespace

bool is_gltf(const std::filesystem::path& file) {
  return mesh_extension(file) == ".gltf" || mesh_extension(file) == ".glb";
}

MeshOrReason read_mesh(const std::filesystem::path& file, double unit_m) {
  if (const auto why = base::why_unreadable(file)) return {{}, *why};
  const std::string extension = mesh_extension(file);
  if (!is_gltf(file) && extension != ".obj" && extension != ".stl" && extension != ".ply")
    return {{}, "the file name must end in .gltf, .glb, .obj, .stl or .ply"};
  Assimp::Importer importer;
  importer.SetIOHandler(new RegularFiles);  // the importer owns it
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  // Runs before JoinIdenticalVertices, which treats NaN as equal to every vertex.
  if (scene != nullptr)
    if (const auto vertex = not_finite_vertex(*scene))
      return {{}, "vertex " + std::to_string(*vertex) + " of the mesh is not finite"};
  if (scene != nullptr) scene = simplified(importer);
  if (scene == nullptr)
    return {{}, std::string("cannot read the mesh: ") + importer.GetErrorString()};
  MeshOrReason result;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i)
    append(result.mesh, *scene->mMeshes[i], unit_m, is_gltf(file));
  if (result.mesh.triangles.empty()) return {{}, "the mesh has no triangles"};
  for (const Eigen::Vector3d& v : result.mesh.vertices_m)
    if (!v.allFinite()) return {{}, "a transformation in the mesh file is not finite"};
  for (const auto& triangle : result.mesh.triangles)
    for (const std::uint32_t index : triangle)
      if (index >= result.mesh.vertices_m.size())
        return {{}, "a triangle of the mesh refers to a vertex that does not exist"};
  return result;
}

}  // namespace fivepipe::config
