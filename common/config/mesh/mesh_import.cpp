#include "common/config/mesh/mesh_import.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <exception>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "common/base/readable_file.h"
#include "common/config/mesh/gltf_check.h"
#include "common/config/mesh/limited_child.h"
#include "common/config/mesh/material_import.h"
#include "common/config/mesh/mesh_bytes.h"
#include "common/config/mesh/step_module.h"

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

// Open CASCADE needs about 0.4 s and 20 MB of memory for each MB of a STEP file.
constexpr std::uintmax_t kStepBytesPerCpu_s = 200'000;
constexpr std::uintmax_t kStepMemoryPerByte = 400;

ChildLimits step_limits_for(std::uintmax_t file_bytes) {
  const auto cpu_s = unsigned(file_bytes / kStepBytesPerCpu_s);
  return {cpu_s, kElapsedPerCpuTime * cpu_s, std::size_t(file_bytes * kStepMemoryPerByte)};
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
    if (error || !is_within_limits(file, file_bytes)) {
      if (!first_refused_) first_refused_ = file;
      return nullptr;
    }
    auto content = std::make_unique<std::uint8_t[]>(file_bytes);
    std::ifstream in(file, std::ios::binary);
    if (!in.read(reinterpret_cast<char*>(content.get()), std::streamsize(file_bytes)))
      return nullptr;
    return new Assimp::MemoryIOStream(content.release(), file_bytes, true);  // Close() deletes it
  }

  // If only the mesh file could be opened, returns the first one that could not.
  std::optional<std::string> first_refused() const {
    return opened_.size() == 1 ? first_refused_ : std::nullopt;
  }

  // The files that were opened, without this one.
  std::vector<std::filesystem::path> opened_beside(const std::filesystem::path& mesh_file) const {
    std::vector<std::filesystem::path> files;
    for (const std::string& file : opened_)
      if (file != mesh_file.string()) files.emplace_back(file);
    return files;
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
  std::optional<std::string> first_refused_;
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

constexpr int kUnneeded = aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                          aiComponent_COLORS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                          aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS;
// Makes triangles in the file's axes, one mesh per material.
constexpr unsigned kFlatten =
    aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices;

// Removes components from the scene, then applies the steps. Returns null if one fails.
const aiScene* processed(Assimp::Importer& importer, int removed, unsigned steps) {
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, removed);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  return importer.ApplyPostProcessing(aiProcess_RemoveComponent | steps);
}

// Keeps positions only, so that equal corners become one vertex even if their normals or texture
// coordinates differ. Before that, appends each mesh with its texture coordinates to `materials`,
// unless that is null.
const aiScene* simplified(Assimp::Importer& importer, MaterialImport* materials) {
  if (materials == nullptr)
    return processed(importer, kUnneeded | aiComponent_TEXCOORDS,
                     kFlatten | aiProcess_JoinIdenticalVertices);
  const aiScene* scene = processed(importer, kUnneeded, kFlatten);
  if (scene == nullptr) return nullptr;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) materials->append(*scene->mMeshes[i]);
  return processed(importer, aiComponent_TEXCOORDS, aiProcess_JoinIdenticalVertices);
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

ImportedMesh failed(std::string reason) { return {{}, {}, std::move(reason)}; }

std::optional<std::string> why_unsupported_gltf(const std::filesystem::path& file,
                                                Materials materials) {
  std::error_code error;
  const std::uintmax_t file_bytes = std::filesystem::file_size(file, error);
  if (!error) raise_own_limits(limits_for(std::min(file_bytes, kMaxFileBytes)));
  return why_unsupported(gltf_json(file), materials == Materials::with);
}

// An OBJ file without its material file is drawn in one colour, as if it named none. Assimp tries
// the file that the OBJ file names, then one with the OBJ file's name.
std::vector<std::string> notes_of(const RegularFiles& files) {
  const std::optional<std::string> refused = files.first_refused();
  if (!refused) return {};
  return {"its material file " + *refused + " cannot be read; colour_rgb gives the colour"};
}

// Returns the mesh of a scene that has been simplified.
ImportedMesh mesh_of(const aiScene* scene) {
  ImportedMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    append(mesh, *scene->mMeshes[i]);
    if (std::max(mesh.vertices.size(), mesh.triangles.size()) > kMaxMeshElements)
      return failed("the mesh has more than " + std::to_string(kMaxMeshElements) +
                    " vertices or triangles");
  }
  return mesh;
}

ImportedMesh import_step(const std::filesystem::path& file, std::optional<double> unit_m) {
  std::error_code error;
  const std::uintmax_t file_bytes = std::filesystem::file_size(file, error);
  if (!error) raise_own_limits(step_limits_for(std::min(file_bytes, kMaxFileBytes)));
  ImportedMesh mesh;
  ReadStep* read_step = nullptr;
  try {
    read_step = reinterpret_cast<ReadStep*>(base::function_of(kStepModule, kReadStep));
  } catch (const std::runtime_error& missing) {
    return failed(std::string(missing.what()) +
                  "; with the Debian package fivepipe, install fivepipe-step instead");
  }
  read_step(file.string(), unit_m, mesh);
  return mesh;
}

ImportedMesh import_here(const std::filesystem::path& file, const std::string& extension,
                         Materials which) {
  const bool is_of_gltf = extension == "gltf" || extension == "glb";
  if (is_of_gltf)
    if (const auto why = why_unsupported_gltf(file, which)) return failed(*why);
  Assimp::Importer importer;
  keep_importers_of(extension, importer);
  RegularFiles* const files = new RegularFiles;
  importer.SetIOHandler(files);  // the importer owns it
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  if (scene != nullptr)
    if (const auto why = why_unusable(*scene)) return failed(*why);
  std::optional<MaterialImport> materials;
  std::vector<std::string> notes;
  if (scene != nullptr && which == Materials::with && (is_of_gltf || extension == "obj")) {
    notes = notes_of(*files);
    if (notes.empty()) materials.emplace(*scene, file);
    if (materials && materials->failure()) return failed(*materials->failure());
    if (materials && !materials->has_materials()) materials.reset();
    if (materials)
      if (const auto why = materials->prepare(const_cast<aiScene&>(*scene))) return failed(*why);
  }
  std::vector<std::filesystem::path> other_files = files->opened_beside(file);
  if (scene != nullptr) scene = simplified(importer, materials ? &*materials : nullptr);
  if (scene == nullptr) {
    throw_if_out_of_memory(importer);
    return failed(std::string("cannot read the mesh: ") + importer.GetErrorString());
  }
  ImportedMesh mesh = mesh_of(scene);
  mesh.files = std::move(other_files);
  if (materials)
    mesh.materials = materials->take(std::move(notes));
  else if (!notes.empty())
    mesh.materials = MeshMaterials{{}, {}, {}, std::move(notes)};
  return mesh;
}

}  // namespace

ImportedMesh import_mesh(const std::filesystem::path& file, const std::string& extension,
                         Materials materials, std::optional<double> step_unit_m) {
  const bool is_step = extension == "step" || extension == "stp";
  const unsigned cpu_s = is_step ? kStepImport_s : kImport_s;
  const ChildResult result = call_in_child(
      [&] {
        return bytes_of(is_step ? import_step(file, step_unit_m)
                                : import_here(file, extension, materials));
      },
      {cpu_s, kElapsedPerCpuTime * cpu_s, kImport_bytes});
  if (!result.failure.empty())
    return failed("the importer " + result.failure + ": the file is damaged or too large");
  if (auto mesh = mesh_from(result.bytes)) return std::move(*mesh);
  return failed("the importer returns no mesh: the file is damaged");
}

ImageOrReason embedded_image(const std::filesystem::path& file, const std::string& extension,
                             int index) {
  const auto bytes_of_image = [&]() -> std::string {
    Assimp::Importer importer;
    keep_importers_of(extension, importer);
    importer.SetIOHandler(new RegularFiles);  // the importer owns it
    const aiScene* const scene = importer.ReadFile(file.string(), 0);
    if (scene == nullptr || index < 0 || unsigned(index) >= scene->mNumTextures) return "";
    const aiTexture& image = *scene->mTextures[index];
    if (image.mHeight != 0 || image.pcData == nullptr) return "";
    return {reinterpret_cast<const char*>(image.pcData), image.mWidth};
  };
  ChildResult result =
      call_in_child(bytes_of_image, {kImport_s, kElapsedPerCpuTime * kImport_s, kImport_bytes});
  if (!result.failure.empty())
    return {"", "the importer " + result.failure + ": the file is damaged or too large"};
  if (result.bytes.empty()) return {"", "there is no such image"};
  return {std::move(result.bytes), ""};
}

}  // namespace fivepipe::config
