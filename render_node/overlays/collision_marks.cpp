#include "render_node/overlays/collision_marks.h"

namespace fivepipe::render {

std::map<std::string, OverlaidObject> overlaid_objects(const config::Scene& scene) {
  std::map<std::string, OverlaidObject> objects;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const config::SceneObject& object = scene.objects[i];
    OverlaidObject overlaid{.object = i};
    for (const config::Overlay overlay : scene.overlays)
      if (config::reports(object, overlay)) overlaid.shown.insert(overlay);
    if (overlaid.shown.empty()) continue;
    if (overlaid.shown.contains(config::Overlay::proximity)) {
      overlaid.mesh = config::mesh_of(object);
      overlaid.proximity_of = object.requests.proximity->of;
    }
    objects.emplace(object.name, std::move(overlaid));
  }
  return objects;
}

}  // namespace fivepipe::render
