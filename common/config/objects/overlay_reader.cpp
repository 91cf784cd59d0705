#include "common/config/objects/overlay_reader.h"

#include <fmt/format.h>

#include <string>

namespace fivepipe::config {
namespace {

std::string name_of(Overlay overlay) {
  switch (overlay) {
    case Overlay::collision_points: return "collision_points";
    case Overlay::recovery: return "recovery";
    case Overlay::hull_normals: return "hull_normals";
    case Overlay::proximity: break;
  }
  return "proximity";
}

// What a scene must add so that an object reports what the overlay shows.
std::string remedy_for(Overlay overlay) {
  switch (overlay) {
    case Overlay::collision_points:
      return "give an object another reaction than none; reaction contact also needs a report";
    case Overlay::recovery: return "add `report: {response: {}}` to an object";
    case Overlay::hull_normals:
      return "add `report: {response: {closed_form_normal: true}}` to an object";
    case Overlay::proximity: break;
  }
  return "add `report: {proximity: {}}` to an object";
}

}  // namespace

std::set<Overlay> read_overlays(YamlMap& scene, const std::function<bool(Overlay)>& is_reported) {
  std::vector<std::pair<std::string, Overlay>> choices;
  for (const Overlay overlay :
       {Overlay::collision_points, Overlay::recovery, Overlay::hull_normals, Overlay::proximity})
    choices.emplace_back(name_of(overlay), overlay);
  std::set<Overlay> overlays;
  for (const auto& [overlay, location] : scene.choices<Overlay>("overlays", choices)) {
    overlays.insert(overlay);
    if (!is_reported(overlay))
      scene.problems().add(scene.file(), location,
                           fmt::format("overlay {} shows nothing, because no object reports it: {}",
                                       name_of(overlay), remedy_for(overlay)));
  }
  return overlays;
}

}  // namespace fivepipe::config
