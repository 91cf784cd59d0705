// Rig, scene and deployment files. The valid ones are those of the repository, and a scene and a
// head path that use the keys which no shipped file has.
#include <algorithm>
#include <stdexcept>

#include "common/config/read_files.h"
#include "tests/fuzz/config_invariants.h"
#include "tests/fuzz/message_bytes.h"
#include "tests/fuzz/mutations.h"

namespace fivepipe::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr const char *kDeployment = "deployment.yaml", *kRig = "rig.yaml", *kScene = "scene.yaml",
                     *kPath = "path.csv", *kMesh = "part.obj";

const std::string kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const std::string kHeadPath =
    "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m\n0,0,-1,0.5,0,0,0.2\n"
    "1.5,0.1,-1,0.5,0,0,0.2\n4,0,-1,0.5,0,0,0.2\n";
const std::string kEveryRequest = R"(name: requests
gravity_m_s2: 1.62
history: {cell_m: 0.01, window_frames: 12, max_speed_m_s: 3}
light_m: [0.5, -1, 2]
lights_real_objects: true
shadows: {target_m: [0, 0, 0], fov_deg: 50, near_m: 0.2, far_m: 6, map_px: 256,
          hull_size_px: [80, 60]}
overlays: [collision_points, recovery, hull_normals, proximity]
particles:
  - name: grains
    from_m: [-0.1, -0.1, 1]
    to_m: [0.1, 0.1, 1.1]
    velocity_m_s: [0, 0.5, -1]
    spread_m_s: 0.2
    rate_hz: 500
    lifetime_s: 4
    drag_1_s: 0.3
    radius_m: 0.004
    restitution: 0.4
    friction: 0.6
    colour_rgb: [0.9, 0.7, 0.1]
objects:
  - name: plate
    box: {size_m: [0.4, 0.4, 0.01], cell_m: 0.1}
    position_m: [0, 0, 0]
    rotation_deg: [0, 10, 90]
    warmth: {cap_m: 0.2, tolerance_m: 0.01, heating_s: 1, cooling_s: 9, colour_rgb: [1, 0, 0]}
    report:
      triangles: true
      response: {search: outward, apex_angle_deg: 60, height_m: 0.1, v_rec: [0, 0, 2],
                 four_point_normal: true, closed_form_normal: true, local_minimum_translation: true}
      contacts: 6
      proximity: {of: triangles, cap_m: 0.3, tolerance_m: 0.001}
      first_contact: true
  - name: ball
    sphere: {radius_m: 0.5, subdivisions: 1}
    position_m: [0, 0, 1]
    motion: dynamic
    reaction: contact
    mass_kg: 0.25
    restitution: 0.75
    friction: 0.2
    velocity_m_s: [0, 1, 0]
  - name: curtain
    curtain: {width_m: 0.6, height_m: 0.4, columns: 20, rows: 18, fold_depth_m: 0.01, fold_count: 3}
    position_m: [0, 0, 1]
    motion: cloth
    reaction: yield
    cloth:
      density_kg_m2: 0.3
      stretch_compliance_m_n: 1e-4
      compression_compliance_m_n: 2
      shear_compliance_m_n: 0.01
      bending_compliance_1_nm: 9000
      damping_s: 0.002
      air_drag_1_s: 0.5
      thickness_m: 0.004
      friction: 0.4
      self_collision: true
      object_collision: true
      v_rec: [0, 2, 0]
      pins:
        - {from_m: [-1, -1, -0.001], to_m: [1, 1, 0.001], slides_along: [1, 0, 0]}
  - name: door
    box: {size_m: [0.8, 0.04, 2]}
    position_m: [3, 0, 1]
    motion: dynamic
    reaction: contact
    hinge: {point_m: [-0.4, 0, 0], axis: [0, 0, 1], from_deg: -5, to_deg: 90, damping_1_s: 2}
  - name: drawer
    box: {size_m: [0.4, 0.4, 0.1]}
    position_m: [-3, 0, 1]
    motion: dynamic
    reaction: contact
    slider: {axis: [0, -1, 0], from_m: 0, to_m: 0.3, damping_1_s: 1}
  - name: part
    mesh: {file: part.obj, unit: cm}
    position_m: [0, 0, 0]
    reaction: none
    pattern: checker
    pattern_size_m: 0.05
)";
const std::string kEveryNodeKey = R"(name: nodes
rig: rig.yaml
scene: scene.yaml
domain: 3
network_profile: loopback
settings: {data: "/tmp", factor: 2}
viewer:
  name: eye
  file: path.csv
  horizontal_fov_deg: 60
  near_m: 0.1
  far_m: 4
  stereo: {eye_distance_m: 0.063}
nodes:
  - name: capture
    program: capture_node
    sources: synthetic
    synthetic: {seed: 2, period_s: 3, noise_sigma_levels: 4, cast_shadow: false, prerender: true}
    segmentation: {threshold_sigmas: 5, threshold_floor_levels: 10, threshold_ceiling_levels: 20,
                   jitter_px: 1, hysteresis: 3, moving_boxes: 2, gain_compensation: false,
                   shadow_min_brightness: 0.4, shadow_tint_degrees: 1, min_object_px: 5,
                   max_hole_px: 6, opening_px: 2, closing_px: 1, conservative: true,
                   adaptation_s: 9, cameras: {left: {max_hole_px: 3}},
                   volume_m: {min: [-1, -1, 0], max: [1, 1, 2]}}
    loop: false
    lost_camera: wait
    max_frames_in_flight: 2
    precomputed_frames: 10
  - name: recon
    program: recon_node
    backend: sweep
    threads: ${factor}
    sweep_planes: 32
    tile_columns: 4
    tile_rows: 3
    split: frames
    balance: false
    cores: [0, 1]
  - name: simulation
    program: sim_node
    host: other
    collision: paper
    eps_m: 0.001
    spacing_m: 0.01
    viewport_px: 12
    window_px: 300
    step_s: 0.01
    max_points: 100
  - name: rendering
    program: render_node
    window: true
    video: false
    still_frame: 5
)";

// For the rig table4.
const std::string kEveryLiveSource = R"(name: live
rig: rig.yaml
scene: scene.yaml
viewer:
  path: [{t_s: 0, eye_m: [0, -1, 0.5], target_m: [0, 0, 0.2]}]
nodes:
  - name: capture
    program: capture_node
    sources:
      up_left: {gstreamer: "v4l2src device=/dev/video2 ! jpegdec", background_frames: 20}
      up_far: {rtsp: "rtsp://user:password@10.0.0.2:554/stream?channel=1", chroma_key: {}}
      up_right: {genicam: Maker-7, exposure_us: 4000.5, gain_db: 3, background_frames: 60}
      table_height: {v4l2: 2, chroma_key: {rgb: [0, 0.2, 1], max_angle_deg: 20, min_chroma: 0.2}}
  - {name: rendering, program: render_node}
)";

std::string source_file(const fs::path& path) {
  const std::string text = bytes_of_file(fs::path(FIVEPIPE_SOURCE_DIR) / path);
  if (text.empty()) throw std::runtime_error("cannot read " + path.string());
  return text;
}

const std::vector<std::string>& rigs() {
  static const std::vector<std::string> texts = {
      source_file("scenes/rigs/table4.yaml"), source_file("scenes/rigs/ring16.yaml"),
      source_file("scenes/rigs/paper.yaml"), source_file("scenes/seated4cam/rig.yaml"),
      source_file("scenes/balance4cam/rig.yaml")};
  return texts;
}

const std::vector<std::string>& scenes() {
  static const std::vector<std::string> texts = {kEveryRequest,
                                                 source_file("scenes/demo/scene.yaml"),
                                                 source_file("scenes/seated4cam/scene.yaml"),
                                                 source_file("scenes/warm_plate/scene.yaml"),
                                                 source_file("scenes/curtain/scene.yaml"),
                                                 source_file("scenes/blocks/scene.yaml"),
                                                 source_file("scenes/door/scene.yaml"),
                                                 source_file("scenes/particles/scene.yaml"),
                                                 source_file("tests/recordings/scene.yaml")};
  return texts;
}

// Replaces the paths of rig and scene by those of the input's files.
std::string with_local_files(std::string text) {
  for (const std::string key : {"rig", "scene"}) {
    const std::size_t at = text.find("\n" + key + ": ") + 1;
    text.replace(at, text.find('\n', at) - at, key + ": " + key + ".yaml");
  }
  return text;
}

const std::vector<std::string>& deployments() {
  static const std::vector<std::string> texts = {
      kEveryNodeKey,
      kEveryLiveSource,
      with_local_files(source_file("launch/deployments/demo.yaml")),
      with_local_files(source_file("launch/deployments/paper.yaml")),
      with_local_files(source_file("launch/deployments/warm_plate.yaml")),
      with_local_files(source_file("launch/deployments/curtain.yaml")),
      with_local_files(source_file("launch/deployments/seated4cam.yaml"))};
  return texts;
}

// Changes one or two numbers, which the reader often accepts, or anything.
std::string mutated(Random& random, std::string text, const std::vector<std::string>& others) {
  if (one_in(random, 2)) {
    mutate_number(random, text);
    if (one_in(random, 2)) mutate_number(random, text);
    return text;
  }
  for (std::size_t mutations = below(random, 5); mutations > 0; --mutations)
    mutate_yaml(random, text, any_of(random, others));
  return text;
}

std::string mutated_head_path(Random& random) {
  std::string path = kHeadPath;
  while (one_in(random, 2)) mutate_word(random, path, {"", ",", "\n", "\r", " ", "t_s", "\"1\""});
  if (one_in(random, 8)) mutate_bytes(random, path);
  return path;
}

template <typename Content>
Verdict check_file(const fs::path& file, Content (*read)(const fs::path&, config::Problems&)) {
  config::Problems problems;
  const Content content = read(file, problems);
  try {
    problems.throw_if_any();
  } catch (const config::ConfigError& error) {
    return {false, broken_invariant(error)};
  }
  return {true, broken_invariant(content)};
}

std::vector<File> rig_input(Random& random) {
  return {{kRig, mutated(random, any_of(random, rigs()), rigs())}};
}
Verdict check_rig(const fs::path& folder) { return check_file(folder / kRig, config::read_rig); }

std::vector<File> scene_input(Random& random) {
  return {{kScene, mutated(random, any_of(random, scenes()), scenes())}, {kMesh, kTetrahedron}};
}
Verdict check_scene(const fs::path& folder) {
  return check_file(folder / kScene, config::read_scene);
}

// Damages mostly the deployment file; the other targets damage the files that it names.
std::vector<File> deployment_input(Random& random) {
  std::string deployment = mutated(random, any_of(random, deployments()), deployments());
  std::string rig = any_of(random, rigs()), scene = any_of(random, scenes()), path = kHeadPath;
  if (one_in(random, 8)) rig = mutated(random, rig, rigs());
  if (one_in(random, 8)) scene = mutated(random, scene, scenes());
  if (one_in(random, 4)) path = mutated_head_path(random);
  return {{kDeployment, std::move(deployment)},
          {kRig, std::move(rig)},
          {kScene, std::move(scene)},
          {kPath, std::move(path)},
          {kMesh, kTetrahedron}};
}

Verdict check_deployment(const fs::path& folder) {
  try {
    return {true, broken_invariant(config::load_deployment(folder / kDeployment))};
  } catch (const config::ConfigError& error) {
    return {false, broken_invariant(error)};
  }
}

}  // namespace

Target rig_target() { return {"rig", "rig files", rig_input, check_rig}; }
Target scene_target() { return {"scene", "scene files", scene_input, check_scene}; }
Target deployment_target() {
  return {"deployment", "deployment files, with the files that they name", deployment_input,
          check_deployment};
}

}  // namespace fivepipe::fuzz
