// Reads the mappings `report` and `warmth` of a scene's object, and `history` of the scene. An
// unusable value is a problem and reads as its default.
#pragma once
#include "common/config/collision_requests.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

CollisionRequests read_collision_requests(YamlMap map);
Warming read_warming(YamlMap map);
HistoryRequests read_history_requests(YamlMap map);

}  // namespace fivepipe::config
