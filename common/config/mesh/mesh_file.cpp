#include "common/config/mesh/mesh_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <system_error>

#include "common/base/readable_file.h"
#include "common/config/mesh/image_header.h"

namespace fivepipe::config {

namespace {

constexpr std::array kFormats = {"gltf", "glb", "obj", "stl", "ply", "step", "stp"};

// Returns the file name's extension in lower case, without its dot.
std::string mesh_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension.empty() ? "" : extension.substr(1);
}

bool is_step(const std::filesystem::path& file) {
  return mesh_extension(file) == "step" || mesh_extension(file) == "stp";
}

ImageOrReason read_image_file(const std::filesystem::path& file) {
  if (const auto why = base::why_unreadable(file)) return {"", *why};
  std::error_code error;  // file_size() then returns the largest number
  const std::uintmax_t file_bytes = std::filesystem::file_size(file, error);
  if (file_bytes > kMaxImageBytes) return {"", "the image file is larger than 256 MiB"};
  std::string bytes(file_bytes, '\0');
  if (!std::ifstream(file, std::ios::binary).read(bytes.data(), std::streamsize(file_bytes)))
    return {"", "the file cannot be read"};
  return {std::move(bytes), ""};
}

}  // namespace

bool is_gltf(const std::filesystem::path& file) {
  return mesh_extension(file) == "gltf" || mesh_extension(file) == "glb";
}

bool has_unit(const std::filesystem::path& file) { return is_gltf(file) || is_step(file); }

std::string name_of(const MaterialTexture& texture) {
  return texture.embedded < 0 ? texture.file.string()
                              : "image " + std::to_string(texture.embedded) + " in " +
                                    texture.file.filename().string();
}

ImageOrReason read_texture_image(const MaterialTexture& texture) {
  ImageOrReason image =
      texture.embedded < 0
          ? read_image_file(texture.file)
          : embedded_image(texture.file, mesh_extension(texture.file), texture.embedded);
  if (!image.reason.empty()) return image;
  if (const auto why = why_no_texture(image.bytes, true)) return {"", *why};
  return image;
}

MeshOrReason read_mesh(const std::filesystem::path& file, std::optional<double> unit_m,
                       Materials materials) {
  if (const auto why = base::why_unreadable(file)) return {{}, *why};
  const std::string extension = mesh_extension(file);
  if (std::find(kFormats.begin(), kFormats.end(), extension) == kFormats.end())
    return {{}, "the file name must end in .gltf, .glb, .obj, .stl, .ply, .step or .stp"};
  if (!unit_m && !has_unit(file)) return {{}, "the format has no unit of length"};
  std::error_code error;  // file_size() then returns the largest number
  if (std::filesystem::file_size(file, error) > kMaxFileBytes)
    return {{}, "the file is larger than 4 GiB"};
  ImportedMesh imported = import_mesh(file, extension, materials, unit_m);
  if (!imported.reason.empty()) return {{}, imported.reason};
  if (imported.triangles.empty()) return {{}, "the mesh has no triangles"};
  const bool y_is_up = is_gltf(file);  // glTF 2.0, section 3.4
  const double scale = is_step(file) ? 1 : unit_m.value_or(1);
  MeshOrReason result{{{}, std::move(imported.triangles)}, ""};
  for (const auto& [x, y, z] : imported.vertices) {
    const Eigen::Vector3d v = y_is_up ? Eigen::Vector3d(x, -z, y) : Eigen::Vector3d(x, y, z);
    if (!v.allFinite()) return {{}, "a transformation in the mesh file is not finite"};
    result.mesh.vertices_m.emplace_back(scale * v);
  }
  result.files = std::move(imported.files);
  if (imported.materials)
    result.materials = std::make_shared<const MeshMaterials>(std::move(*imported.materials));
  return result;
}

}  // namespace fivepipe::config
