// Reads the settings of a scene object that moves as cloth.
#pragma once
#include "common/config/cloth_settings.h"
#include "common/config/yaml/yaml_reader.h"
#include "common/geometry/mesh.h"

namespace fivepipe::config {

// `mesh`: the object's mesh, in its frame. Reports pins that contain no vertex, and a mesh with a
// triangle without area.
ClothSettings read_cloth(YamlMap map, const geometry::Mesh& mesh);

}  // namespace fivepipe::config
