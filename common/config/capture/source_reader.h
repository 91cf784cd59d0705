// Reads the source of one camera: a video, a device or a stream, and how its objects are found.
#pragma once
#include "common/config/capture/capture_config.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// is_here: the node runs on this machine, so the files must be readable.
CameraSource read_source(YamlMap map, bool is_here);

}  // namespace fivepipe::config
