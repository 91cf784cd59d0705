// Reads the light's view of a scene file.
#pragma once
#include "common/config/objects/lighting.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// `light_world_m`: the light's position. Reports every problem at its key.
ShadowView read_shadows(YamlMap map, const Eigen::Vector3d& light_world_m);

}  // namespace fivepipe::config
