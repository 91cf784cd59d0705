// `report` and `warmth` of a scene's object, and `history` of the scene.
#pragma once
#include "common/config/collision_requests.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

CollisionWishes read_collision_wishes(YamlMap map);
Warming read_warming(YamlMap map);
HistoryWishes read_history_wishes(YamlMap map);

}  // namespace fivepipe::config
