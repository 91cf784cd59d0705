#include "common/config/mesh/mesh_bytes.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <type_traits>

#include "common/config/mesh/material_bytes.h"

namespace fivepipe::config {

namespace {

// The sizes, then the reason, the vertices, the triangles, the names of the files, each with a null
// byte behind it, and the bytes of the materials, if any.
struct Sizes {
  std::uint64_t reason, vertices, triangles, file_bytes, material_bytes;
};
using Vertex = decltype(ImportedMesh::vertices)::value_type;
using Triangle = decltype(ImportedMesh::triangles)::value_type;
static_assert(std::is_trivially_copyable_v<Sizes> && std::is_trivially_copyable_v<Vertex> &&
              std::is_trivially_copyable_v<Triangle>);

}  // namespace

std::string bytes_of(const ImportedMesh& mesh) {
  const std::string materials = mesh.materials ? bytes_of(*mesh.materials) : "";
  std::string files;
  for (const std::filesystem::path& file : mesh.files) files += file.string() + '\0';
  const Sizes sizes{mesh.reason.size(), mesh.vertices.size(), mesh.triangles.size(), files.size(),
                    materials.size()};
  std::string bytes(reinterpret_cast<const char*>(&sizes), sizeof sizes);
  bytes += mesh.reason;
  bytes.append(reinterpret_cast<const char*>(mesh.vertices.data()),
               sizeof(Vertex) * mesh.vertices.size());
  bytes.append(reinterpret_cast<const char*>(mesh.triangles.data()),
               sizeof(Triangle) * mesh.triangles.size());
  return bytes + files + materials;
}

std::optional<ImportedMesh> mesh_from(const std::string& bytes) {
  Sizes sizes{};
  if (bytes.size() < sizeof sizes) return std::nullopt;
  std::memcpy(&sizes, bytes.data(), sizeof sizes);
  // The sums below cannot overflow.
  if (std::max({sizes.reason, sizes.file_bytes, sizes.material_bytes}) > bytes.size() ||
      std::max(sizes.vertices, sizes.triangles) > kMaxMeshElements)
    return std::nullopt;
  const std::size_t vertices_at = sizeof sizes + sizes.reason,
                    triangles_at = vertices_at + sizeof(Vertex) * sizes.vertices,
                    files_at = triangles_at + sizeof(Triangle) * sizes.triangles,
                    materials_at = files_at + sizes.file_bytes;
  if (materials_at + sizes.material_bytes != bytes.size()) return std::nullopt;
  ImportedMesh mesh{std::vector<Vertex>(sizes.vertices), std::vector<Triangle>(sizes.triangles),
                    bytes.substr(sizeof sizes, sizes.reason)};
  std::copy(bytes.begin() + std::ptrdiff_t(vertices_at),
            bytes.begin() + std::ptrdiff_t(triangles_at),
            reinterpret_cast<char*>(mesh.vertices.data()));
  std::copy(bytes.begin() + std::ptrdiff_t(triangles_at), bytes.begin() + std::ptrdiff_t(files_at),
            reinterpret_cast<char*>(mesh.triangles.data()));
  for (const Triangle& triangle : mesh.triangles)
    if (*std::max_element(triangle.begin(), triangle.end()) >= sizes.vertices) return std::nullopt;
  for (std::size_t at = files_at; at < materials_at;) {
    const std::size_t end = bytes.find('\0', at);
    if (end >= materials_at) return std::nullopt;  // also if there is none
    mesh.files.emplace_back(bytes.substr(at, end - at));
    at = end + 1;
  }
  if (sizes.material_bytes == 0) return mesh;
  mesh.materials =
      materials_from(std::string_view(bytes).substr(materials_at), mesh.triangles.size());
  if (!mesh.materials) return std::nullopt;
  return mesh;
}

}  // namespace fivepipe::config
