#include "common/config/segmentation_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/config/capture/image_path.h"
#include "common/config/read_files.h"
#include "common/geometry/box_visibility.h"

namespace fivepipe::config {
namespace {

// Returns true if the key of `map` is a camera of the rig that gives shape. Reports any other one,
// unless the deployment leaves it out.
bool is_shape_camera(YamlMap& map, const std::string& key, const Rig& rig) {
  for (const RigCamera& camera : rig.cameras) {
    if (camera.name != key) continue;
    if (!camera.gives_shape)
      map.problem_at(key, "camera " + key + " gives no shape: it has no object pixels");
    return camera.gives_shape;
  }
  if (std::find(rig.left_out.begin(), rig.left_out.end(), key) == rig.left_out.end())
    map.problem_at(key, fmt::format("rig {} has no camera {}", rig.name, key));
  return false;
}

// Reports the cameras that see no part of the volume: their maps, and so the hull, would be empty.
void check_volume(YamlMap& map, const Rig& rig, const Eigen::AlignedBox3d& volume_m) {
  for (const RigCamera& camera : rig.cameras)
    if (camera.gives_shape && camera.mount == Mount::world && camera.published.width_px > 0 &&
        !geometry::is_box_visible(published_camera(camera), volume_m))
      map.problem_at("volume_m", "camera " + camera.name + " sees no part of this volume_m");
}

// Pictures by camera.
std::map<std::string, std::string> read_regions(YamlMap map, const Rig& rig, bool is_here) {
  std::map<std::string, std::string> regions;
  for (const std::string& camera : map.keys()) {
    std::string path = read_image_path(map, camera, is_here);
    if (is_shape_camera(map, camera, rig)) regions[camera] = std::move(path);
  }
  map.finish();
  return regions;
}

// Reads the settings that every camera can have for itself. config: the values of absent keys.
SegmentationConfig read_settings(YamlMap& map, SegmentationConfig config, const Rig& rig) {
  constexpr Range kGreyLevels{0, 255}, kRadius_px{0, 64}, kArea_px{0, 1e6};
  config.threshold_sigmas = map.number("threshold_sigmas", {0, 1000}, config.threshold_sigmas);
  config.threshold_floor_levels =
      map.number("threshold_floor_levels", kGreyLevels, config.threshold_floor_levels);
  config.threshold_ceiling_levels =
      map.number("threshold_ceiling_levels", kGreyLevels,
                 std::max(config.threshold_ceiling_levels, config.threshold_floor_levels));
  if (config.threshold_ceiling_levels < config.threshold_floor_levels)
    map.problem_at("threshold_ceiling_levels",
                   fmt::format("threshold_ceiling_levels must be at least threshold_floor_levels "
                               "({}), is {}",
                               config.threshold_floor_levels, config.threshold_ceiling_levels));
  config.jitter_px = map.number("jitter_px", {0, 10}, config.jitter_px);
  config.hysteresis = map.number("hysteresis", {1, 10}, config.hysteresis);
  config.moving_boxes = map.integer("moving_boxes", {0, 16}, config.moving_boxes);
  config.gain_compensation = map.flag("gain_compensation", config.gain_compensation);
  config.shadow_min_brightness =
      map.number("shadow_min_brightness", {0, 1, true}, config.shadow_min_brightness);
  config.shadow_tint_degrees =
      map.number("shadow_tint_degrees", {0, 45}, config.shadow_tint_degrees);
  config.min_object_px = map.integer("min_object_px", kArea_px, config.min_object_px);
  config.max_hole_px = map.integer("max_hole_px", kArea_px, config.max_hole_px);
  config.opening_px = map.integer("opening_px", kRadius_px, config.opening_px);
  config.closing_px = map.integer("closing_px", kRadius_px, config.closing_px);
  config.conservative = map.flag("conservative", config.conservative);
  config.adaptation_s = map.number("adaptation_s", {0, 86400}, config.adaptation_s);
  if (map.is_text("volume_m")) {
    enum class Owner { rig_volume };
    map.choice<Owner>("volume_m", {{"rig", Owner::rig_volume}});
    config.volume_m = rig.volume_m;
  } else if (map.has("volume_m")) {
    const std::size_t problems_before = map.problem_count();
    config.volume_m = read_volume(map.map("volume_m"));
    if (map.problem_count() == problems_before) check_volume(map, rig, *config.volume_m);
  }
  return config;
}

// Settings by camera.
std::map<std::string, SegmentationConfig> read_cameras(YamlMap map,
                                                       const SegmentationConfig& of_all,
                                                       const Rig& rig) {
  std::map<std::string, SegmentationConfig> by_camera;
  for (const std::string& camera : map.keys()) {
    YamlMap settings = map.map(camera);
    SegmentationConfig of_camera = read_settings(settings, of_all, rig);
    settings.finish();
    if (is_shape_camera(map, camera, rig)) by_camera[camera] = std::move(of_camera);
  }
  map.finish();
  return by_camera;
}

}  // namespace

void read_segmentation(YamlMap map, const Rig& rig, bool is_here, CaptureConfig& config) {
  config.segmentation = read_settings(map, {}, rig);
  if (map.has("regions"))
    config.segmentation.regions = read_regions(map.map("regions"), rig, is_here);
  if (map.has("cameras"))
    config.segmentation_of = read_cameras(map.map("cameras"), config.segmentation, rig);
  map.finish();
}

}  // namespace fivepipe::config
