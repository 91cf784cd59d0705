// Reads the mapping `segmentation` of a capture node: the settings of all cameras, and those of
// single cameras, which inherit the others.
#pragma once
#include "common/config/capture/capture_config.h"
#include "common/config/rig.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// is_here: the node runs on this machine, so the pictures of `regions` must be readable.
void read_segmentation(YamlMap map, const Rig& rig, bool is_here, CaptureConfig& config);

}  // namespace fivepipe::config
