// Reads the settings of a scene object that moves as cloth.
#pragma once
#include "common/config/objects/cloth_settings.h"
#include "common/config/yaml/yaml_reader.h"
#include "common/geometry/mesh.h"

namespace fivepipe::config {

// Reports a mesh that cannot be simulated as cloth, at the key of the object: more than
// kMaxClothTriangles triangles, or one without area. Returns whether it can.
bool check_cloth_mesh(const YamlMap& object, const std::string& key, const geometry::Mesh& mesh);

// `mesh`: the object's mesh, in its frame. Reports pins that contain no vertex.
ClothSettings read_cloth(YamlMap map, const geometry::Mesh& mesh);

}  // namespace fivepipe::config
