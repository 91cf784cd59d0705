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

}  // namespace fivepipe::config
