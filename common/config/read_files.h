// The readers behind load_rig, load_scene and load_deployment: they add to `problems` instead of
// throwing. What they return is to be used only where there were none.
#pragma once
#include <filesystem>

#include "common/config/deployment.h"
#include "common/config/yaml/problems.h"

namespace fivepipe::config {

Rig read_rig(const std::filesystem::path& file, Problems& problems);
Scene read_scene(const std::filesystem::path& file, Problems& problems);

// A CSV file of eye poses: the header t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m,
// then a key a line.
std::vector<HeadKey> read_head_path(const std::filesystem::path& file, Problems& problems);

// What is wrong with a path of eye poses, by key: times that do not start at 0 and rise, an eye
// that looks straight up, down or nowhere. Also between the keys.
struct HeadPathFault {
  std::size_t key;
  std::string what;
};
std::vector<HeadPathFault> head_path_faults(const std::vector<HeadKey>& path);

// Triangles of a glTF, OBJ, STL or PLY file, scaled by unit_m; a reason where it can't be used (no
// triangles, an importer's error, a vertex that is not finite). glTF's y axis is up: it becomes
// this project's z.
bool is_gltf(const std::filesystem::path& file);
struct MeshOrReason {
  geometry::Mesh mesh;
  std::string reason;  // empty: usable
};
MeshOrReason read_mesh(const std::filesystem::path& file, double unit_m);

}  // namespace fivepipe::config
