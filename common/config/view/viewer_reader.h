// Reads a viewer of a deployment: its own one, or that of a spectator.
#pragma once
#include <string>

#include "common/config/view/viewer.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Add problems to those of `map`.
Viewer read_viewer(YamlMap map);
// The viewer has the name of the render_node that draws for it.
Viewer read_spectator(YamlMap map, const std::string& node);

}  // namespace fivepipe::config
