#include "common/config/mesh/mesh_bytes.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <type_traits>

#include "common/config/mesh/material_bytes.h"

namespace fivepipe::config {

namespace {

// The sizes, then the reason, the vertices, the triangles, and the bytes of the materials, if any.
struct Sizes {
  std::uint64_t reason, vertices, triangles, material_bytes;
};
using Vertex = decltype(ImportedMesh::vertices)::value_type;
using Triangle = decltype(ImportedMesh::triangles)::value_type;
static_assert(std::is_trivially_copyable_v<Sizes> && std::is_trivially_copyable_v<Vertex> &&
              std::is_trivially_copyable_v<Triangle>);

}  // namespace

std::string bytes_of(const ImportedMesh& mesh) {
  const std::string materials = mesh.materials ? bytes_of(*mesh.materials) : "";
  const Sizes sizes{mesh.reason.size(), mesh.vertices.size(), mesh.triangles.size(),
                    materials.size()};
  std::string bytes(reinterpret_cast<const char*>(&sizes), sizeof sizes);
  bytes += mesh.reason;
  bytes.append(reinterpret_cast<const char*>(mesh.vertices.data()),
               sizeof(Vertex) * mesh.vertices.size());
  bytes.append(reinterpret_cast<const char*>(mesh.triangles.data()),
               sizeof(Triangle) * mesh.triangles.size());
  return bytes + materials;
}

std::optional<ImportedMesh> mesh_from(const std::string& bytes) {
  Sizes sizes{};
  if (bytes.size() < sizeof sizes) return std::nullopt;
  std::memcpy(&sizes, bytes.data(), sizeof sizes);
  // The sums below cannot overflow.
  if (std::max(sizes.reason, sizes.material_bytes) > bytes.size() ||
      std::max(sizes.vertices, sizes.triangles) > kMaxMeshElements)
    return std::nullopt;
  const std::size_t vertices_at = sizeof sizes + sizes.reason,
                    triangles_at = vertices_at + sizeof(Vertex) * sizes.vertices,
                    materials_at = triangles_at + sizeof(Triangle) * sizes.triangles;
  if (materials_at + sizes.material_bytes != bytes.size()) return std::nullopt;
  ImportedMesh mesh{std::vector<Vertex>(sizes.vertices), std::vector<Triangle>(sizes.triangles),
                    bytes.substr(sizeof sizes, sizes.reason)};
  std::copy(bytes.begin() + std::ptrdiff_t(vertices_at),
            bytes.begin() + std::ptrdiff_t(triangles_at),
            reinterpret_cast<char*>(mesh.vertices.data()));
  std::copy(bytes.begin() + std::ptrdiff_t(triangles_at),
            bytes.begin() + std::ptrdiff_t(materials_at),
            reinterpret_cast<char*>(mesh.triangles.data()));
  for (const Triangle& triangle : mesh.triangles)
    if (*std::max_element(triangle.begin(), triangle.end()) >= sizes.vertices) return std::nullopt;
  if (sizes.material_bytes == 0) return mesh;
  mesh.materials =
      materials_from(std::string_view(bytes).substr(materials_at), mesh.triangles.size());
  if (!mesh.materials) return std::nullopt;
  return mesh;
}

}  // namespace fivepipe::config
