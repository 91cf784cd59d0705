// Reads the triangles and materials of mesh files.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/config/mesh/material.h"
#include "common/config/mesh/mesh_import.h"
#include "common/geometry/mesh.h"

namespace fivepipe::config {

// Returns true if the file name ends in .gltf or .glb.
bool is_gltf(const std::filesystem::path& file);
// Returns true if the format has a unit of length: glTF is in metres, and a STEP file states its
// own.
bool has_unit(const std::filesystem::path& file);

// Reads the triangles of a glTF, OBJ, STL, PLY or STEP file and multiplies the vertices by unit_m
// [m]. nullopt: the unit of the format, if it has one. That of a STEP file cannot be replaced:
// another unit_m is a reason. Its surfaces become triangles (step_module.h: deflections).
// Returns a reason if the mesh is unusable: no triangles, no unit, an importer that fails, crashes
// or exceeds its limits (mesh_import.h), or a vertex that is not finite. glTF's y axis is up; it
// becomes this project's z axis. A child process imports the file, so that a damaged one does not
// end this process. Materials do not change the mesh; unusable ones (MaterialImport) are a reason.
struct MeshOrReason {
  geometry::Mesh mesh;
  std::string reason;                                   // empty: usable
  std::shared_ptr<const MeshMaterials> materials = {};  // null: none
  std::vector<std::filesystem::path> files = {};        // see ImportedMesh
};
MeshOrReason read_mesh(const std::filesystem::path& file, std::optional<double> unit_m,
                       Materials materials = Materials::without);

// Reads the image file of a texture, which may be inside a mesh file, without decoding it. The
// reason states that it cannot be read, or is no texture (image_header.h).
ImageOrReason read_texture_image(const MaterialTexture& texture);

}  // namespace fivepipe::config
