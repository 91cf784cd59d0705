// Readers of the files that a deployment names. They add to `problems` instead of throwing, so that
// load_deployment() reports the problems of all files together. Use the result only if the reader
// added no problem.
#pragma once
#include <filesystem>

#include "common/config/deployment.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Read a rig file, and a scene file with its mesh files.
Rig read_rig(const std::filesystem::path& file, Problems& problems);
// Reads a world box: `min` and `max`. Returns an empty box if it has problems.
Eigen::AlignedBox3d read_volume(YamlMap map);
Scene read_scene(const std::filesystem::path& file, Problems& problems);

// Reads a CSV file of eye poses: the header
// t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m, then one key per line.
std::vector<HeadKey> read_head_path(const std::filesystem::path& file, Problems& problems);

// Returns true if an eye that looks at the target has a defined up direction in its image: the
// target is neither at the eye nor straight above or below it. `up` is a unit vector.
bool has_up_direction(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m,
                      const Eigen::Vector3d& up);

// Returns the faults of a path of eye poses, by key: times must start at 0 and increase; at and
// between the keys, the eye must not look straight up or down, nor have its target at its own
// position.
struct HeadPathFault {
  std::size_t key;
  std::string what;
};
std::vector<HeadPathFault> head_path_faults(const std::vector<HeadKey>& path);

}  // namespace fivepipe::config
