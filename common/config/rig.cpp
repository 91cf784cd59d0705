#include "common/config/rig.h"

#include <fmt/format.h>

#include <limits>
#include <map>

#include "common/config/read_files.h"
#include "common/config/view/head_path.h"
#include "common/config/yaml/yaml_reader.h"
#include "common/geometry/box_visibility.h"

namespace fivepipe::config {

namespace {

constexpr Range kPositive{0, kUnbounded, true};
// A pinhole image grows without bound towards 180 degrees.
constexpr Range kFieldOfView_deg{0.01, 170};
// A calibration that is worse found other points than those of its pattern.
constexpr Range kCalibrationError_px{0, 100};

geometry::Pinhole read_pinhole(YamlMap& map) {
  const auto [width_px, height_px] = map.size_px("image_size_px");
  const bool by_angle = map.has("horizontal_fov_deg");
  if (by_angle) {
    for (const std::string key : {"fx_px", "fy_px", "cx_px", "cy_px"})
      if (map.has(key))
        map.problem_at(key, key + " and horizontal_fov_deg are both set: remove one");
    const double fov_rad = map.number("horizontal_fov_deg", kFieldOfView_deg) * kDegree_rad;
    return geometry::pinhole_from_fov(width_px, height_px, fov_rad);
  }
  if (!map.has("fx_px") && !map.has("fy_px") && !map.has("cx_px") && !map.has("cy_px")) {
    map.problem(
        "focal length is missing: set horizontal_fov_deg, or fx_px, fy_px, cx_px and cy_px");
    return {};
  }
  return {width_px,
          height_px,
          map.number("fx_px", kPositive),
          map.number("fy_px", kPositive),
          map.number("cx_px", kAny),
          map.number("cy_px", kAny)};
}

geometry::LensDistortion read_distortion(YamlMap map) {
  geometry::LensDistortion d;
  d.k1 = map.number("k1", kAny);
  d.k2 = map.number("k2", kAny);
  d.p1 = map.number("p1", kAny);
  d.p2 = map.number("p2", kAny);
  d.k3 = map.number("k3", kAny);
  map.finish();
  return d;
}

// Reads look_at in the frame of the mount. Up is +z in the world and -y in the viewer's eye frame.
Eigen::Isometry3d read_look_at(YamlMap map, Mount mount) {
  const std::size_t problems_before = map.problem_count();
  const Eigen::Vector3d eye_m = map.vector3("eye_m", kAny),
                        target_m = map.vector3("target_m", kAny);
  map.finish();
  const Eigen::Vector3d up =
      mount == Mount::world ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(0, -1, 0);
  if (map.is_void() || map.problem_count() > problems_before) return Eigen::Isometry3d::Identity();
  if (!has_up_direction(eye_m, target_m, up)) {
    map.problem(
        "look_at has no up direction: target_m is at eye_m, or straight above or below it; use a "
        "rotation instead");
    return Eigen::Isometry3d::Identity();
  }
  return geometry::look_at(eye_m, target_m, up);
}

Eigen::Isometry3d read_pose(YamlMap map) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = map.matrix3("rotation");
  pose.translation() = map.vector3("translation_m", kAny);
  map.finish();
  return pose;
}

// Reads the pose: exactly one of look_at and camera_from_world (camera_from_viewer for a camera on
// the viewer).
Eigen::Isometry3d read_camera_from_mount(YamlMap& map, Mount mount) {
  const std::string key = mount == Mount::world ? "camera_from_world" : "camera_from_viewer";
  const std::string wrong_key = mount == Mount::world ? "camera_from_viewer" : "camera_from_world";
  if (map.has(wrong_key))
    map.problem_at(wrong_key, wrong_key + " does not match the camera's mount: use " + key);
  const bool has_look_at = map.has("look_at"), has_pose = map.has(key);
  if (has_look_at && has_pose) map.problem_at(key, key + " and look_at are both set: remove one");
  if (has_pose) return read_pose(map.map(key));
  if (has_look_at) return read_look_at(map.map("look_at"), mount);
  if (!map.has(wrong_key)) map.problem("the camera has no pose: set look_at or " + key);
  return Eigen::Isometry3d::Identity();
}

void check_usable(const YamlMap& map, RigCamera& camera) {
  for (const auto& [pinhole, prefix] :
       {std::pair{camera.source, ""}, {camera.published, "published: "}})
    if (const auto why = geometry::why_unusable({pinhole, camera.camera_from_mount})) {
      map.problem("camera " + camera.name + ": " + prefix + *why);
      return;
    }
  camera.camera_from_mount.linear() = geometry::nearest_rotation(camera.camera_from_mount.linear());
}

// Returns the pinhole of all that the captured image shows.
geometry::Pinhole whole_published(const YamlMap& map, const RigCamera& camera) {
  const geometry::Pinhole whole = geometry::whole_pinhole(camera.source, camera.distortion);
  if (whole.width_px <= kMaxImageSize_px && whole.height_px <= kMaxImageSize_px) return whole;
  map.problem(fmt::format(
      "camera {}: without its distortion, the image would have {} x {} pixels, more than {}: set "
      "published to a smaller one, or correct the distortion",
      camera.name, whole.width_px, whole.height_px, kMaxImageSize_px));
  return camera.source;
}

// The width or height of the box in the image [px], whichever is larger; infinite if a corner of
// the box is not in front of the camera.
double size_px(const geometry::Camera& camera, const Eigen::AlignedBox3d& box_m) {
  Eigen::AlignedBox2d bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const auto seen =
        geometry::project(camera, box_m.corner(Eigen::AlignedBox3d::CornerType(corner)));
    if (!seen) return std::numeric_limits<double>::infinity();
    bounds.extend(*seen);
  }
  return bounds.sizes().maxCoeff();
}
// Poses in millimetres, with a volume in metres, are a thousand times too far away.
constexpr int kMinVolume_px = 4;

RigCamera read_camera(YamlMap map, const Eigen::AlignedBox3d& volume_m) {
  const std::size_t problems_before = map.problem_count();
  RigCamera camera;
  camera.name = map.name("name");
  camera.mount = map.choice<Mount>("mount", {{"world", Mount::world}, {"viewer", Mount::viewer}},
                                   Mount::world);
  const bool is_world = camera.mount == Mount::world;
  camera.gives_shape = map.flag("gives_shape", is_world);
  camera.gives_colour = map.flag("gives_colour", true);
  camera.source = read_pinhole(map);
  if (map.has("distortion")) camera.distortion = read_distortion(map.map("distortion"));
  if (map.has("calibration_error_px"))
    camera.calibration_error_px = map.number("calibration_error_px", kCalibrationError_px);
  const bool is_readable = map.problem_count() == problems_before;
  if (map.has("published")) {
    YamlMap published = map.map("published");
    camera.published = read_pinhole(published);
    published.finish();
  } else if (is_readable) {
    camera.published = whole_published(map, camera);
  }
  camera.camera_from_mount = read_camera_from_mount(map, camera.mount);
  if (camera.gives_shape && !is_world)
    map.problem_at("gives_shape", "gives_shape must be false for a camera with mount viewer");
  map.finish();
  if (map.problem_count() > problems_before) return camera;
  check_usable(map, camera);
  if (map.problem_count() == problems_before && camera.gives_shape && !volume_m.isEmpty() &&
      !geometry::is_box_visible(published_camera(camera), volume_m))
    map.problem("camera " + camera.name +
                " sees no part of volume_m: check its pose (is it that from world to camera, with "
                "translation_m in metres?) and volume_m");
  else if (map.problem_count() == problems_before && camera.gives_shape && !volume_m.isEmpty() &&
           size_px(published_camera(camera), volume_m) < kMinVolume_px)
    map.problem(
        fmt::format("camera {} sees volume_m as less than {} px: check its pose (is "
                    "translation_m in metres?) and volume_m",
                    camera.name, kMinVolume_px));
  return camera;
}

}  // namespace

Eigen::AlignedBox3d read_volume(YamlMap map) {
  const std::size_t problems_before = map.problem_count();
  const Eigen::AlignedBox3d volume_m(map.vector3("min", kAny), map.vector3("max", kAny));
  map.finish();
  if (map.is_void() || map.problem_count() > problems_before) return {};
  for (int axis = 0; axis < 3; ++axis)
    if (!(volume_m.min()[axis] < volume_m.max()[axis]))
      map.problem_at("max", fmt::format("max must be greater than min ({}) in {}, is {}",
                                        volume_m.min()[axis], "xyz"[axis], volume_m.max()[axis]));
  return map.problem_count() > problems_before ? Eigen::AlignedBox3d() : volume_m;
}

Rig read_rig(const std::filesystem::path& file, Problems& problems) {
  YamlMap map = YamlMap::load(file, problems);
  Rig rig;
  if (map.is_void()) return rig;
  rig.name = map.name("name");
  rig.volume_m = read_volume(map.map("volume_m"));
  std::map<std::string, int> line_of_name;
  for (YamlMap& camera_map : map.maps("cameras")) {
    rig.cameras.push_back(read_camera(camera_map, rig.volume_m));
    const std::string& name = rig.cameras.back().name;
    const auto [first, is_new] =
        line_of_name.try_emplace(name, camera_map.location_of("name").line);
    if (!is_new && !name.empty())
      camera_map.problem_at(
          "name", fmt::format("camera name {} is already used in line {}", name, first->second));
  }
  if (!rig.cameras.empty() && shape_cameras(rig).empty())
    map.problem_at("cameras",
                   "no camera gives shape: set gives_shape to true for a camera with mount world");
  map.finish();
  return rig;
}

geometry::Camera published_camera(const RigCamera& camera,
                                  const Eigen::Isometry3d& eye_from_world) {
  return {camera.published, camera.mount == Mount::world
                                ? camera.camera_from_mount
                                : camera.camera_from_mount * eye_from_world};
}

std::vector<std::size_t> shape_cameras(const Rig& rig) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    if (rig.cameras[i].gives_shape) indices.push_back(i);
  return indices;
}

}  // namespace fivepipe::config
