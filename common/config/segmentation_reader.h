// Reads the mapping `segmentation` of a capture node.
#pragma once
#include "common/config/capture/capture_config.h"
#include "common/config/rig.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// is_here: the node runs on this machine, so the pictures of `regions` must be readable.
SegmentationConfig read_segmentation(YamlMap map, const Rig& rig, bool is_here);

}  // namespace fivepipe::config
