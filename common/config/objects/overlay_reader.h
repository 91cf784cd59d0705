// Reads the overlays of a scene file.
#pragma once
#include <functional>
#include <set>

#include "common/config/objects/overlay.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

// Reads the key `overlays` of a scene; an empty set if it is absent. is_reported: whether an object
// of the scene reports what the overlay shows. Reports an overlay that would show nothing at its
// place, with what the scene must add.
std::set<Overlay> read_overlays(YamlMap& scene, const std::function<bool(Overlay)>& is_reported);

}  // namespace fivepipe::config
