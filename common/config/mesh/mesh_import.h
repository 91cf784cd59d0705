// Imports mesh files with Assimp, and STEP files with Open CASCADE. Both crash or never end on some
// damaged files.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/config/mesh/material.h"

namespace fivepipe::config {

// A mesh in the file's unit and axes; of a STEP file, in metres. Triangles refer to its vertices. A
// vertex may be NaN or infinite.
struct ImportedMesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::string reason;  // why the file is unusable; empty: usable
  // Absent if the file has none, or with Materials::without.
  std::optional<MeshMaterials> materials = {};
  // The other files that the importer has read: buffers of a glTF file, material files of an OBJ
  // file. Not the textures.
  std::vector<std::filesystem::path> files = {};
};
enum class Materials { without, with };

// Imports the file in a child process. If the importer crashes there, or exceeds its limits, the
// reason states it. `extension` names the format: "gltf", "glb", "obj", "stl", "ply", "step" or
// "stp". Only the importers of that format read the file and the files that it names. Materials do
// not change the vertices and triangles. Images are checked, not decoded. step_unit_m: if a STEP
// file states another unit than this [m], the reason states both.
ImportedMesh import_mesh(const std::filesystem::path& file, const std::string& extension,
                         Materials materials = Materials::without,
                         std::optional<double> step_unit_m = std::nullopt);

// Returns the bytes of an image inside a glTF file, by its index in MaterialTexture.
struct ImageOrReason {
  std::string bytes;
  std::string reason;  // empty: usable
};
ImageOrReason embedded_image(const std::filesystem::path& file, const std::string& extension,
                             int index);

// Limits of an import: these, and more for each byte of the files that it reads.
inline constexpr unsigned kImport_s = 2, kStepImport_s = 10;  // CPU time
inline constexpr std::size_t kImport_bytes = std::size_t(1) << 29;
// A mesh with more vertices or triangles than this is refused. The fastest collision queries handle
// 1e6 triangles in real time.
inline constexpr std::size_t kMaxMeshElements = 10'000'000;
// The files of a mesh may have this many bytes together, which bounds the limits of its import. A
// text with kMaxMeshElements vertices, normals and triangles has less than 300 bytes for each.
inline constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t(4) << 30;

}  // namespace fivepipe::config
