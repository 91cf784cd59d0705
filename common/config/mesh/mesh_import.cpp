#include "common/config/mesh/mesh_import.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <exception>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "common/base/readable_file.h"
#include "common/config/mesh/limited_child.h"
#include "common/config/mesh/mesh_bytes.h"

namespace fivepipe::config {

namespace {

// Slow hardware imports more than 2 MB of text per second, with less than 40 bytes of memory per
// byte.
constexpr std::uintmax_t kBytesPerCpu_s = 1'000'000;
constexpr std::uintmax_t kMemoryPerByte = 100;
// The elapsed time may be longer than the CPU time, on a busy machine.
constexpr unsigned kElapsedPerCpuTime = 10;

ChildLimits limits_for(std::uintmax_t file_bytes) {
  const auto cpu_s = unsigned(file_bytes / kBytesPerCpu_s);
  return {cpu_s, kElapsedPerCpuTime * cpu_s, std::size_t(file_bytes * kMemoryPerByte)};
}

// An OBJ file names material files and a glTF file names buffers. Refuses those that are no regular
// files, of which a pipe would keep the reader waiting. Reads each file as a whole, because some
// importers otherwise call the system for each byte, and raises the limits by its size.
class RegularFiles : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override { return !base::why_unreadable(file); }
  Assimp::IOStream* Open(const char* file, const char*) override {
    std::error_code error;  // file_size() fails if the file is not a regular one
    const std::uintmax_t file_bytes = std::filesystem::file_size(file, error);
    if (error || !is_within_limits(file, file_bytes)) return nullptr;
    auto content = std::make_unique<std::uint8_t[]>(file_bytes);
    std::ifstream in(file, std::ios::binary);
    if (!in.read(reinterpret_cast<char*>(content.get()), std::streamsize(file_bytes)))
      return nullptr;
    return new Assimp::MemoryIOStream(content.release(), file_bytes, true);  // Close() deletes it
  }

 private:
  bool is_within_limits(const char* file, std::uintmax_t file_bytes) {
    if (opened_.contains(file)) return true;
    if (file_bytes > kMaxFileBytes - opened_bytes_) return false;
    opened_.insert(file);
    opened_bytes_ += file_bytes;
    raise_own_limits(limits_for(file_bytes));
    return true;
  }

  std::set<std::string> opened_;
  std::uintmax_t opened_bytes_ = 0;  // at most kMaxFileBytes
};

// Assimp chooses an importer by the file's content if that of the extension refuses the file. Keeps
// only those of the extension.
void keep_importers_of(const std::string& extension, Assimp::Importer& importer) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    std::istringstream extensions(importer.GetImporterInfo(i)->mFileExtensions);
    std::string each;
    bool is_of_extension = false;
    while (extensions >> each) is_of_extension = is_of_extension || each == extension;
    if (!is_of_extension) importer.UnregisterLoader(importer.GetImporter(i));
  }
}

// Returns why post-processing cannot use the scene: it compares vertices, and NaN is equal to every
// vertex there; and it does not check the indices of faces.
std::optional<std::string> why_unusable(const aiScene& scene) {
  std::size_t count = 0;
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    const aiMesh& mesh = *scene.mMeshes[i];
    for (unsigned j = 0; j < mesh.mNumVertices; ++j, ++count) {
      const aiVector3D& v = mesh.mVertices[j];
      if (!(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)))
        return "vertex " + std::to_string(count) + " of the mesh is not finite";
    }
    for (unsigned j = 0; j < mesh.mNumFaces; ++j)
      for (unsigned k = 0; k < mesh.mFaces[j].mNumIndices; ++k)
        if (mesh.mFaces[j].mIndices[k] >= mesh.mNumVertices)
          return "a face of the mesh refers to a vertex that does not exist";
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

void append(ImportedMesh& mesh, const aiMesh& part) {
  const auto first = std::uint32_t(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    mesh.vertices.push_back({v.x, v.y, v.z});
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i)
    if (const aiFace& face = part.mFaces[i]; face.mNumIndices == 3)
      mesh.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
}

// Assimp catches what an importer throws, and keeps only the text of what a later step throws.
void throw_if_out_of_memory(const Assimp::Importer& importer) {
  if (const std::exception_ptr& exception = importer.GetException()) try {
      std::rethrow_exception(exception);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (...) {
    }
  if (std::string_view(importer.GetErrorString()) == std::bad_alloc().what())
    throw std::bad_alloc();
}

ImportedMesh import_here(const std::filesystem::path& file, const std::string& extension) {
  Assimp::Importer importer;
  keep_importers_of(extension, importer);
  importer.SetIOHandler(new RegularFiles);  // the importer owns it
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  if (scene != nullptr)
    if (const auto why = why_unusable(*scene)) return {{}, {}, *why};
  if (scene != nullptr) scene = simplified(importer);
  if (scene == nullptr) throw_if_out_of_memory(importer);
  if (scene == nullptr)
    return {{}, {}, std::string("cannot read the mesh: ") + importer.GetErrorString()};
  ImportedMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    append(mesh, *scene->mMeshes[i]);
    if (std::max(mesh.vertices.size(), mesh.triangles.size()) > kMaxMeshElements)
      return {
          {},
          {},
          "the mesh has more than " + std::to_string(kMaxMeshElements) + " vertices or triangles"};
  }
  return mesh;
}

}  // namespace

ImportedMesh import_mesh(const std::filesystem::path& file, const std::string& extension) {
  const ChildResult result =
      call_in_child([&] { return bytes_of(import_here(file, extension)); },
                    {kImport_s, kElapsedPerCpuTime * kImport_s, kImport_bytes});
  if (!result.failure.empty())
    return {{}, {}, "the importer " + result.failure + ": the file is damaged or too large"};
  if (const auto mesh = mesh_from(result.bytes)) return *mesh;
  return {{}, {}, "the importer returns no mesh: the file is damaged"};
}

}  // namespace fivepipe::config
