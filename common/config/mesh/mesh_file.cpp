#include "common/config/mesh/mesh_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <system_error>

#include "common/base/readable_file.h"
#include "common/config/mesh/mesh_import.h"

namespace fivepipe::config {

namespace {

constexpr std::array kFormats = {"gltf", "glb", "obj", "stl", "ply"};

// Returns the file name's extension in lower case, without its dot.
std::string mesh_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension.empty() ? "" : extension.substr(1);
}

}  // namespace

bool is_gltf(const std::filesystem::path& file) {
  return mesh_extension(file) == "gltf" || mesh_extension(file) == "glb";
}

MeshOrReason read_mesh(const std::filesystem::path& file, double unit_m) {
  if (const auto why = base::why_unreadable(file)) return {{}, *why};
  const std::string extension = mesh_extension(file);
  if (std::find(kFormats.begin(), kFormats.end(), extension) == kFormats.end())
    return {{}, "the file name must end in .gltf, .glb, .obj, .stl or .ply"};
  std::error_code error;  // file_size() then returns the largest number
  if (std::filesystem::file_size(file, error) > kMaxFileBytes)
    return {{}, "the file is larger than 4 GiB"};
  ImportedMesh imported = import_mesh(file, extension);
  if (!imported.reason.empty()) return {{}, imported.reason};
  if (imported.triangles.empty()) return {{}, "the mesh has no triangles"};
  const bool y_is_up = is_gltf(file);  // glTF 2.0, section 3.4
  MeshOrReason result{{{}, std::move(imported.triangles)}, ""};
  for (const auto& [x, y, z] : imported.vertices) {
    const Eigen::Vector3d v = y_is_up ? Eigen::Vector3d(x, -z, y) : Eigen::Vector3d(x, y, z);
    if (!v.allFinite()) return {{}, "a transformation in the mesh file is not finite"};
    result.mesh.vertices_m.emplace_back(unit_m * v);
  }
  return result;
}

}  // namespace fivepipe::config
