#include "common/config/view/viewer_reader.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <vector>

#include "common/config/view/head_path.h"

namespace fivepipe::config {
namespace {

std::vector<HeadKey> read_keys(YamlMap& map) {
  const std::size_t problems_before = map.problem_count();
  std::vector<HeadKey> path;
  std::vector<YamlMap> keys = map.maps("path");
  for (YamlMap& key : keys) {
    const double t_s =
        key.number("t_s", {0, kUnbounded}, keys.size() == 1 ? std::optional(0.0) : std::nullopt);
    path.push_back({t_s, key.vector3("eye_m", kAny), key.vector3("target_m", kAny)});
    key.finish();
  }
  if (map.problem_count() == problems_before)
    for (const HeadPathFault& fault : head_path_faults(path)) keys[fault.key].problem(fault.what);
  return path;
}

// The name of an eye's view is the viewer's, a slash and "right", and has at most 32 characters in
// a message.
constexpr std::size_t kMaxStereoName = 26;
// Half of the largest texture of common OpenGL drivers: one texture holds both eyes.
constexpr int kMaxStereoWidth_px = 8192;

void read_stereo(YamlMap& map, Viewer& viewer) {
  if (!map.has("stereo")) return;
  YamlMap stereo = map.map("stereo");
  viewer.eye_distance_m = stereo.number("eye_distance_m", {0, 1, true});
  stereo.finish();
  if (viewer.name.size() > kMaxStereoName)
    map.problem_at(map.has("name") ? "name" : "stereo",
                   fmt::format("name of a stereo viewer must have at most {} characters, "
                               "has {}",
                               kMaxStereoName, viewer.name.size()));
  if (viewer.render_width_px > kMaxStereoWidth_px)
    map.problem_at("render_size_px",
                   fmt::format("render_size_px[0] of a stereo viewer must be at most {}, is {}",
                               kMaxStereoWidth_px, viewer.render_width_px));
}

// Reads all keys but the name.
void read_view(YamlMap& map, Viewer& viewer) {
  if (map.has("path") && map.has("file"))
    map.problem_at("file", "path and file are both set: remove one");
  if (map.has("file")) {
    viewer.file = map.path("file");
    if (!viewer.file.empty()) viewer.path = read_head_path(viewer.file, map.problems());
  } else {
    viewer.path = read_keys(map);
  }
  viewer.horizontal_fov_rad =
      map.number("horizontal_fov_deg", {1, 170}, viewer.horizontal_fov_rad / kDegree_rad) *
      kDegree_rad;
  const auto [render_width_px, render_height_px] =
      map.size_px("render_size_px", std::array{viewer.render_width_px, viewer.render_height_px});
  const auto [recon_width_px, recon_height_px] =
      map.size_px("recon_size_px", std::array{viewer.recon_width_px, viewer.recon_height_px});
  viewer.render_width_px = render_width_px;
  viewer.render_height_px = render_height_px;
  viewer.recon_width_px = recon_width_px;
  viewer.recon_height_px = recon_height_px;
  viewer.near_m = map.number("near_m", {1e-3, 1e4}, viewer.near_m);
  viewer.far_m = map.number("far_m", {1e-3, 1e5}, viewer.far_m);
  if (!(viewer.near_m < viewer.far_m))
    map.problem(
        fmt::format("near_m ({}) must be less than far_m ({})", viewer.near_m, viewer.far_m));
  read_stereo(map, viewer);
  map.finish();
}

}  // namespace

Viewer read_viewer(YamlMap map) {
  Viewer viewer;
  if (map.is_void()) return viewer;
  viewer.name = map.name("name", viewer.name);
  read_view(map, viewer);
  return viewer;
}

Viewer read_spectator(YamlMap map, const std::string& node) {
  Viewer viewer;
  viewer.name = node;
  if (!map.is_void()) read_view(map, viewer);
  return viewer;
}

}  // namespace fivepipe::config
