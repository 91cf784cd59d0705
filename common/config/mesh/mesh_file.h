// Reads the triangles of mesh files.
#pragma once
#include <filesystem>
#include <string>

#include "common/geometry/mesh.h"

namespace fivepipe::config {

// Returns true if the file name ends in .gltf or .glb.
bool is_gltf(const std::filesystem::path& file);

// Reads the triangles of a glTF, OBJ, STL or PLY file and multiplies the vertices by unit_m [m].
// Returns a reason if the mesh is unusable: no triangles, an importer that fails, crashes or
// exceeds its limits (mesh_import.h), or a vertex that is not finite. glTF's y axis is up; it
// becomes this project's z axis. A child process imports the file, so that a damaged one does not
// end this process.
struct MeshOrReason {
  geometry::Mesh mesh;
  std::string reason;  // empty: usable
};
MeshOrReason read_mesh(const std::filesystem::path& file, double unit_m);

}  // namespace fivepipe::config
