// Reads the joint of a scene object.
#pragma once
#include <optional>

#include "common/config/objects/joint.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Reads the key `hinge` or `slider` of an object; nullopt if it has neither.
std::optional<Joint> read_joint(YamlMap& object);

}  // namespace fivepipe::config
