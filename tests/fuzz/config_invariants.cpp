#include "tests/fuzz/config_invariants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "common/config/read_files.h"
#include "common/config/view/head_path.h"
#include "common/config/views.h"
#include "common/config/yaml/numbers.h"
#include "common/geometry/box_visibility.h"
#include "tests/fuzz/poses.h"

namespace fivepipe::fuzz {
namespace {

using namespace config;

constexpr std::size_t kMaxTriangles = 1'000'000;  // of meshes that the check builds itself

// NaN is in no range.
bool is_in(double value, double min, double max) { return value >= min && value <= max; }
bool is_positive(double value, double max = kUnbounded) { return value > 0 && value <= max; }

bool is_colour(const std::array<double, 3>& rgb) {
  return std::ranges::all_of(rgb, [](double c) { return is_in(c, 0, 1); });
}

bool is_name(const std::string& name, std::size_t max_length = 32) {
  return !name.empty() && name.size() <= max_length &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
}

std::string broken_camera(const RigCamera& camera, const Eigen::AlignedBox3d& volume_m) {
  if (!is_name(camera.name)) return "the name of a camera";
  for (const geometry::Pinhole& pinhole : {camera.source, camera.published}) {
    if (const auto why = geometry::why_unusable({pinhole, camera.camera_from_mount})) return *why;
    if (!is_in(pinhole.width_px, 1, 16384) || !is_in(pinhole.height_px, 1, 16384))
      return "the image size";
  }
  if (!is_rigid(camera.camera_from_mount)) return "the pose is not rigid";
  const geometry::LensDistortion& d = camera.distortion;
  for (const double k : {d.k1, d.k2, d.p1, d.p2, d.k3})
    if (!std::isfinite(k)) return "the distortion is not finite";
  if (camera.gives_shape && camera.mount != Mount::world) return "a moving camera gives shape";
  if (camera.gives_shape && !geometry::is_box_visible(published_camera(camera), volume_m))
    return "a camera sees no part of the volume";
  return "";
}

// Returns the number of triangles that mesh_of() makes.
double triangle_count(const Shape& shape) {
  if (const auto* curtain = std::get_if<CurtainShape>(&shape))
    return 2.0 * curtain->columns * curtain->rows;
  const auto* box = std::get_if<BoxShape>(&shape);
  if (box == nullptr || !(box->cell_m > 0)) return 0;
  const Eigen::Array3d cells = (box->size_m.array() / box->cell_m).ceil();
  return 4 * (cells.x() * cells.y() + cells.y() * cells.z() + cells.z() * cells.x());
}

std::string broken_shape(const Shape& shape) {
  if (const auto* box = std::get_if<BoxShape>(&shape)) {
    for (const double size_m : box->size_m)
      if (!is_positive(size_m, 1e4)) return "size_m of a box";
    if (!is_in(box->cell_m, 0, 1e4)) return "cell_m of a box";
  }
  if (const auto* sphere = std::get_if<SphereShape>(&shape))
    if (!is_positive(sphere->radius_m, 1e4) || !is_in(sphere->subdivisions, 0, 6))
      return "a sphere";
  if (const auto* curtain = std::get_if<CurtainShape>(&shape))
    if (!is_positive(curtain->width_m, 1e4) || !is_positive(curtain->height_m, 1e4) ||
        !is_in(curtain->columns, 1, 1000) || !is_in(curtain->rows, 1, 1000) ||
        !is_in(curtain->fold_depth_m, 0, 10) || !is_in(curtain->fold_count, 0, 1000))
      return "a curtain";
  return "";
}

std::string broken_requests(const SceneObject& object) {
  const CollisionRequests& requests = object.requests;
  if (!is_in(requests.contacts, 0, 64)) return "contacts";
  if (requests.response) {
    if (!is_in(requests.response->height_m, 1e-4, 10)) return "height_m";
    if (!is_in(requests.response->apex_angle_rad, 0.001, 3.14)) return "apex_angle_deg";
    if (const auto& v = requests.response->v_rec_world; v && !(v->allFinite() && v->norm() > 0))
      return "v_rec";
  }
  const auto is_cap = [](double cap_m, double tolerance_m) {
    return is_in(cap_m, 1e-3, 10) && is_in(tolerance_m, 1e-5, 1) && tolerance_m <= cap_m &&
           tolerance_m >= 1e-3 * cap_m;
  };
  if (requests.proximity && !is_cap(requests.proximity->cap_m, requests.proximity->tolerance_m))
    return "cap_m or tolerance_m of proximity";
  if (const auto& warming = object.warming)
    if (!is_cap(warming->cap_m, warming->tolerance_m) || !is_in(warming->heating_s, 1e-3, 3600) ||
        !is_in(warming->cooling_s, 1e-3, 3600) || !is_colour(warming->colour_rgb))
      return "warmth";
  return "";
}

std::string broken_cloth(const SceneObject& object) {
  if (object.cloth.has_value() != (object.motion == Motion::cloth)) return "cloth without motion";
  if (!object.cloth) return "";
  const ClothSettings& cloth = *object.cloth;
  if (!is_in(cloth.density_kg_m2, 1e-3, 100)) return "density_kg_m2";
  for (const double compliance : {cloth.stretch_compliance_m_n, cloth.compression_compliance_m_n,
                                  cloth.shear_compliance_m_n, cloth.bending_compliance_1_nm})
    if (!is_in(compliance, 0, 1e9)) return "a compliance of a cloth";
  if (!is_in(cloth.damping_s, 0, 10) || !is_in(cloth.air_drag_1_s, 0, 1000) ||
      !is_in(cloth.thickness_m, 0, 0.1) || !is_in(cloth.friction, 0, 10))
    return "a number of a cloth";
  if (const auto& v = cloth.v_rec_world; v && !(v->allFinite() && v->norm() > 0))
    return "v_rec of a cloth";
  for (const ClothPin& pin : cloth.pins) {
    if (!pin.box_m.min().allFinite() || !pin.box_m.max().allFinite() || pin.box_m.isEmpty())
      return "the box of a pin";
    if (const auto& v = pin.slides_along; v && !(v->allFinite() && v->norm() > 0))
      return "slides_along of a pin";
  }
  return "";
}

std::string broken_joint(const SceneObject& object) {
  if (!object.joint) return "";
  const Joint& joint = *object.joint;
  if (object.motion != Motion::dynamic) return "a joint of an object that does not move";
  const bool is_hinge = joint.kind == JointKind::hinge;
  const double limit = is_hinge ? kMaxHinge_deg * M_PI / 180 : 100;
  if (!(joint.lowest < joint.highest) || !is_in(joint.lowest, -limit * (1 + 1e-12), 0) ||
      !is_in(joint.highest, 0, limit * (1 + 1e-12)))
    return "the limits of a joint";
  if (!is_in(joint.damping_1_s, 0, 1000)) return "damping_1_s";
  if (!(std::abs(joint.axis.norm() - 1) < 1e-9)) return "the axis of a joint";
  return joint.point_m.allFinite() ? "" : "the point of a joint";
}

std::string broken_particles(const ParticleSource& source) {
  if (!is_name(source.name, 64)) return "the name of a source";
  const Eigen::AlignedBox3d& from_m = source.from_world_m;
  if (!from_m.min().allFinite() || !from_m.max().allFinite() || from_m.isEmpty())
    return "the box of a source";
  for (const double v : source.velocity_world_m_s)
    if (!is_in(v, -100, 100)) return "velocity_m_s of a source";
  const bool is_good = is_in(source.spread_m_s, 0, 100) && is_positive(source.rate_hz, 1e6) &&
                       is_positive(source.lifetime_s, 3600) && is_in(source.drag_1_s, 0, 1000) &&
                       is_positive(source.radius_m, kMaxParticleRadius_m) &&
                       is_in(source.restitution, 0, 1) && is_in(source.friction, 0, 10) &&
                       is_colour(source.colour_rgb) &&
                       source.rate_hz * source.lifetime_s <= kMaxParticles;
  return is_good ? "" : "a number of a source";
}

std::string broken_shadows(const Scene& scene) {
  const ShadowView& shadows = *scene.shadows;
  if (!(shadows.near_m >= 1e-3 && shadows.near_m < shadows.far_m && shadows.far_m <= 1e3))
    return "near_m or far_m of shadows";
  if (!is_in(shadows.map_px, 16, 8192)) return "map_px";
  const HullView view = *light_view(scene);
  if (!is_rigid(*view.fixed)) return "the pose of the light's view is not rigid";
  for (const geometry::Pinhole& pinhole : {view.recon, shadow_map_pinhole(shadows)})
    if (const auto why = geometry::why_unusable({pinhole, *view.fixed}))
      return "the light's view: " + *why;
  return "";
}

std::string broken_object(const SceneObject& object) {
  if (!is_name(object.name, 64)) return "the name of an object";
  if (!is_rigid(object.world_from_object)) return "the pose of an object is not rigid";
  if (!is_positive(object.mass_kg, 1e6)) return "mass_kg";
  if (!is_in(object.restitution, 0, 1)) return "restitution";
  if (!is_in(object.friction, 0, 10)) return "friction";
  for (const double v : object.velocity_world_m_s)
    if (!is_in(v, -100, 100)) return "velocity_m_s";
  if (!is_colour(object.colour_rgb)) return "colour_rgb of an object";
  if (!is_positive(object.pattern_size_m, 1e4)) return "pattern_size_m";
  if (std::string broken = broken_shape(object.shape); !broken.empty()) return broken;
  if (std::string broken = broken_cloth(object); !broken.empty()) return broken;
  if (std::string broken = broken_joint(object); !broken.empty()) return broken;
  if (triangle_count(object.shape) <= double(kMaxTriangles))
    if (std::string broken = broken_invariant(mesh_of(object)); !broken.empty()) return broken;
  return broken_requests(object);
}

std::string broken_viewer(const Viewer& viewer) {
  if (!is_name(viewer.name)) return "the name of the viewer";
  if (viewer.path.empty()) return "the viewer has no path";
  if (!head_path_faults(viewer.path).empty()) return "the viewer's path has faults";
  if (!(viewer.near_m > 0 && viewer.near_m < viewer.far_m && viewer.far_m <= 1e5))
    return "near_m or far_m";
  if (viewer.eye_distance_m && !(is_positive(*viewer.eye_distance_m, 1) &&
                                 viewer.name.size() <= 26 && viewer.render_width_px <= 8192))
    return "stereo";
  const double period_s = viewer.path.back().t_s;
  for (const double part : {0.0, 0.25, 0.5, 0.999999, 1.0, 7.3})
    if (!is_rigid(eye_from_world_at(viewer, part * period_s)))
      return fmt::format("the pose at {} of the path is not rigid", part);
  for (const geometry::Pinhole& pinhole : {render_pinhole(viewer), recon_pinhole(viewer)})
    if (const auto why = geometry::why_unusable({pinhole, Eigen::Isometry3d::Identity()}))
      return "viewer: " + *why;
  return "";
}

bool is_good_genicam(const GenicamSource& source) {
  return !source.camera.empty() && (!source.exposure_us || is_in(*source.exposure_us, 1, 1e7)) &&
         (!source.gain_db || is_in(*source.gain_db, 0, 100));
}

// The address becomes a part of a pipeline's description.
bool is_good_address(const std::string& url) {
  return url.starts_with("rtsp") && url.find_first_of(" \"'\\\n\t") == std::string::npos;
}

// Streams and devices have usable names and settings.
bool has_good_streams(const CaptureConfig& config) {
  for (const auto& [camera, source] : config.sources) {
    if (const auto* const genicam = std::get_if<GenicamSource>(&source))
      if (!is_good_genicam(*genicam)) return false;
    if (const auto* const rtsp = std::get_if<RtspSource>(&source))
      if (!is_good_address(rtsp->url)) return false;
    if (const auto* const gstreamer = std::get_if<GstreamerSource>(&source))
      if (gstreamer->pipeline.empty()) return false;
    const ObjectKey key = key_of(source);
    if (const auto* const background = std::get_if<LearnedBackground>(&key))
      if (!is_in(background->frames, 1, kMaxLearningImages)) return false;
  }
  return true;
}

// The chroma of a key is not zero.
bool has_good_keys(const CaptureConfig& config) {
  for (const auto& [camera, source] : config.sources) {
    const ObjectKey key = key_of(source);
    const auto* const screen = std::get_if<ChromaKey>(&key);
    if (!screen) continue;
    const auto [darkest, brightest] = std::minmax_element(screen->rgb.begin(), screen->rgb.end());
    if (!(*brightest - *darkest > 0.1) || !is_in(screen->max_angle_deg, 1, 90) ||
        !is_positive(screen->min_chroma, 1))
      return false;
  }
  return true;
}

bool is_good_segmentation(const SegmentationConfig& s) {
  return is_in(s.threshold_sigmas, 0, 1000) && is_in(s.threshold_floor_levels, 0, 255) &&
         is_in(s.threshold_ceiling_levels, s.threshold_floor_levels, 255) &&
         is_in(s.jitter_px, 0, 10) && is_in(s.hysteresis, 1, 10) && is_in(s.moving_boxes, 0, 16) &&
         is_positive(s.shadow_min_brightness, 1) && is_in(s.shadow_tint_degrees, 0, 45) &&
         is_in(s.min_object_px, 0, 1e6) && is_in(s.max_hole_px, 0, 1e6) &&
         is_in(s.opening_px, 0, 64) && is_in(s.closing_px, 0, 64) &&
         is_in(s.adaptation_s, 0, 86400) && (!s.volume_m || !s.volume_m->isEmpty());
}

struct BrokenNode {
  std::string operator()(const CaptureConfig& c) const {
    const bool is_good =
        is_in(c.synthetic.period_s, 0.1, 3600) && is_in(c.synthetic.noise_sigma_levels, 0, 255) &&
        is_good_segmentation(c.segmentation) &&
        std::all_of(c.segmentation_of.begin(), c.segmentation_of.end(),
                    [](const auto& of) { return is_good_segmentation(of.second); }) &&
        has_good_keys(c) && has_good_streams(c) && is_in(c.max_frames_in_flight, 0, 64) &&
        is_in(c.precomputed_frames, 0, 100000);
    return is_good ? "" : "a key of capture_node";
  }
  std::string operator()(const ReconConfig& c) const {
    const bool is_good = is_in(c.threads, 1, 256) && is_in(c.sweep_planes, 2, 4096) &&
                         is_in(c.tile_columns, 1, 256) && is_in(c.tile_rows, 1, 256) &&
                         c.worker_count > 0 && is_in(c.worker_index, 0, c.worker_count - 1);
    return is_good ? "" : "a key of recon_node";
  }
  std::string operator()(const SimConfig& c) const {
    const bool is_good = is_in(c.threads, 1, 256) && is_in(c.eps_m, 1e-6, 0.1) &&
                         is_in(c.spacing_m, 1e-5, 1) && is_in(c.viewport_px, 1, c.window_px) &&
                         is_in(c.window_px, 1, 16384) && is_in(c.step_s, 1e-4, 0.1) &&
                         is_in(c.max_points, 1, 1000000);
    return is_good ? "" : "a key of sim_node";
  }
  std::string operator()(const RenderConfig& c) const {
    return c.still_frame >= 0 ? "" : "still_frame";
  }
};

template <typename Items>
bool names_are_unique(const Items& items) {
  std::set<std::string> names;
  return std::ranges::all_of(items, [&](const auto& i) { return names.insert(i.name).second; });
}

int line_count(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return 1 + int(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
}

}  // namespace

std::string broken_invariant(const geometry::Mesh& mesh) {
  if (mesh.triangles.empty()) return "a mesh without triangles";
  for (const Eigen::Vector3d& v : mesh.vertices_m)
    if (!v.allFinite()) return "a vertex that is not finite";
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle)
      if (index >= mesh.vertices_m.size()) return "a triangle without its vertex";
  return "";
}

std::string broken_invariant(const Rig& rig) {
  if (!is_name(rig.name)) return "the name of the rig";
  if (rig.volume_m.isEmpty() || !(rig.volume_m.sizes().minCoeff() > 0)) return "volume_m is empty";
  if (!rig.volume_m.min().allFinite() || !rig.volume_m.max().allFinite())
    return "volume_m is not finite";
  if (shape_cameras(rig).empty()) return "no camera gives shape";
  if (!names_are_unique(rig.cameras)) return "two cameras have one name";
  for (const RigCamera& camera : rig.cameras)
    if (std::string broken = broken_camera(camera, rig.volume_m); !broken.empty()) return broken;
  return "";
}

std::string broken_invariant(const Scene& scene) {
  if (!is_name(scene.name)) return "the name of the scene";
  if (!is_in(scene.gravity_m_s2, 0, 1000)) return "gravity_m_s2";
  if (!scene.light_world_m.allFinite()) return "light_m is not finite";
  if (!is_colour(scene.background_rgb)) return "background_rgb";
  if (scene.objects.empty()) return "a scene without objects";
  if (!names_are_unique(scene.objects)) return "two objects have one name";
  if (const auto& history = scene.history)
    if (!is_in(history->cell_m, 5e-4, 1) || !is_in(history->window_frames, 3, 240) ||
        !is_in(history->max_speed_m_s, 0.01, 1000))
      return "history";
  for (const SceneObject& object : scene.objects)
    if (std::string broken = broken_object(object); !broken.empty()) return broken;
  if (!names_are_unique(scene.particles)) return "two sources have one name";
  for (const ParticleSource& source : scene.particles)
    if (std::string broken = broken_particles(source); !broken.empty()) return broken;
  if (scene.shadows)
    if (std::string broken = broken_shadows(scene); !broken.empty()) return broken;
  mesh_warnings(scene);
  return "";
}

std::string broken_invariant(const Deployment& deployment) {
  if (!is_name(deployment.name)) return "the name of the deployment";
  if (deployment.domain > std::uint32_t(kMaxDomain)) return "domain";
  if (!is_positive(deployment.frame_rate_hz, 1000)) return "frame_rate_hz";
  if (std::string broken = broken_invariant(deployment.rig); !broken.empty()) return broken;
  if (std::string broken = broken_invariant(deployment.scene); !broken.empty()) return broken;
  if (std::string broken = broken_viewer(deployment.viewer); !broken.empty()) return broken;
  if (deployment.nodes.empty() || !names_are_unique(deployment.nodes)) return "nodes";
  for (const Node& node : deployment.nodes) {
    if (!is_name(node.name)) return "the name of a node";
    for (const int core : node.cores)
      if (!is_in(core, 0, 1023)) return "cores";
    if (std::string broken = std::visit(BrokenNode{}, node.config); !broken.empty()) return broken;
  }
  for (const Node& node : deployment.nodes)
    if (const auto* recon = std::get_if<ReconConfig>(&node.config);
        recon &&
        std::size_t(recon->tile_columns * recon->tile_rows) * hull_views(deployment).size() >
            std::size_t(kMaxTilesPerFrame))
      return "too many tiles in a frame";
  for (const std::filesystem::path& file : deployment.files)
    if (!std::filesystem::is_regular_file(file)) return "files lists one that cannot be read";
  if (deployment.scene.history &&
      !((deployment.rig.volume_m.sizes() / deployment.scene.history->cell_m)
            .array()
            .ceil()
            .prod() <= kMaxHistoryCells))
    return "too many cells of the history";
  return "";
}

std::string broken_invariant(const ConfigError& error) {
  if (error.problems().empty()) return "ConfigError without a problem";
  std::map<std::string, int> lines;  // by file
  for (const ConfigProblem& problem : error.problems()) {
    if (problem.what.empty()) return "a problem without a text";
    const bool has_location = problem.line > 0 && problem.column > 0;
    if (!has_location && (problem.line != 0 || problem.column != 0))
      return "half a location: " + problem.what;
    if (!lines.contains(problem.file)) lines[problem.file] = line_count(problem.file);
    if (has_location && problem.line > lines[problem.file])
      return fmt::format("line {} is not in the file: {}", problem.line, problem.what);
  }
  return "";
}

}  // namespace fivepipe::fuzz
