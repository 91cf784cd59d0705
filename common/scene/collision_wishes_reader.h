// `report` and `warmth` of a scene's object, and `history` of the scene.
#pragma once
#include "common/scene/collision_wishes.h"
#include "common/scene/yaml_reader.h"

namespace fivepipe {

CollisionWishes read_collision_wishes(YamlMap map);
Warming read_warming(YamlMap map);
HistoryWishes read_history_wishes(YamlMap map);

}  // namespace fivepipe
