// Writes triangle meshes and point clouds as PLY, OBJ, STL or binary glTF.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/mesh.h"

namespace fivepipe::surface {

// ply: binary, little-endian. stl: binary; has no colour. glb: glTF 2.0; its y axis is up, so
// (x, y, z) is written as (x, z, -y). The others keep the world frame, z up. The unit is the metre.
enum class MeshFormat { ply, obj, stl, glb };
// Returns nullopt if the text is none of ply, obj, stl and glb.
std::optional<MeshFormat> mesh_format_from(std::string_view text);
std::string extension_of(MeshFormat format);  // ".ply"

using Rgb = std::array<std::uint8_t, 3>;  // sRGB

struct MeshFile {
  // Without triangles: a point cloud. With triangles, every vertex should belong to one.
  geometry::Mesh mesh;
  std::vector<Rgb> colours = {};  // by vertex; empty: no colour
  int normal_steps = 0;           // see vertex_normals()
};

// Returns the normal of each vertex: of its triangles, weighted by their areas; z if they have no
// area. Then each is replaced `steps` times by the mean of the vertices of its
// triangles: the boundary of cells then looks smooth.
std::vector<Eigen::Vector3d> vertex_normals(const geometry::Mesh& mesh, int steps = 0);

// Writes coordinates as floats (OBJ: with 6 decimals). Meshes in PLY and glTF have normals. Creates
// missing folders. Throws std::runtime_error if the file cannot be written, and
// std::invalid_argument for a point cloud as STL or for a number of colours other than that of the
// vertices. A file without vertices is written, too; as glTF it has no mesh, which the format
// does not allow to be empty.
void write_mesh(const std::filesystem::path& file, const MeshFile& content, MeshFormat format);

}  // namespace fivepipe::surface
