// Reads the spacing of a scene object.
#pragma once
#include <optional>

#include "common/config/objects/spacing.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Reads the key `spacing` of an object; nullopt if it has none. is_fixed: the object has motion
// fixed; otherwise the key is a problem.
std::optional<Spacing> read_spacing(YamlMap& object, bool is_fixed);

}  // namespace fivepipe::config
