#include "benchmarks/features/feature_scenes.h"

#include <fmt/format.h>

#include "common/base/result_file.h"

namespace fivepipe::feature_bench {
namespace {

constexpr const char* kBaseScene = R"(name: features
light_m: [0.6, -0.8, 1.6]
objects:
  - name: table_top
    box: {size_m: [1.5, 0.9, 0.04]}
    position_m: [0.0, -0.1, -0.02]
    reaction: none
    pattern: checker
  - name: touched_block
    box: {size_m: [0.12, 0.12, 0.12]}
    position_m: [0.12, 0.05, 0.06]
)";

// 720 triangles, as many as the paper's curtain, in the way of the hand.
constexpr const char* kCloth = R"(  - name: curtain
    curtain: {width_m: 0.6, height_m: 0.6, columns: 20, rows: 18, fold_depth_m: 0.01, fold_count: 4}
    position_m: [0.0, 0.05, 0.65]
    motion: cloth
    cloth:
      v_rec: [0, 1, 0]
      pins:
        - {from_m: [-0.4, -0.1, -0.001], to_m: [0.4, 0.1, 0.001]}
)";

// Boxes that fall on the table.
std::string bodies() {
  std::string lines;
  for (int i = 0; i < 10; ++i)
    lines += fmt::format(
        "  - name: box_{0}\n"
        "    box: {{size_m: [0.04, 0.04, 0.04]}}\n"
        "    position_m: [{1:.2f}, -0.25, 0.1]\n"
        "    motion: dynamic\n"
        "    reaction: contact\n"
        "    mass_kg: 0.1\n",
        i, -0.3 + 0.06 * i);
  return lines;
}

constexpr const char* kJoints = R"(  - name: door
    box: {size_m: [0.3, 0.02, 0.4]}
    position_m: [0.0, 0.15, 0.25]
    motion: dynamic
    reaction: contact
    mass_kg: 1.5
    hinge: {point_m: [-0.15, 0, 0], axis: [0, 0, 1], to_deg: 100, damping_1_s: 0.5}
)";

constexpr const char* kParticles = R"(particles:
  - name: grains
    from_m: [-0.2, -0.2, 0.6]
    to_m: [0.2, 0.2, 0.6]
    rate_hz: 2000
    lifetime_s: 1
)";

constexpr const char* kRig = R"(name: features
volume_m: {{min: [-0.75, -0.6, 0.0], max: [0.75, 0.6, 0.9]}}
cameras:
  - name: left
    image_size_px: [{0}, {1}]
    horizontal_fov_deg: 58
    look_at: {{eye_m: [-1.9, -1.0, 1.5], target_m: [-0.05, -0.02, 0.27]}}
  - name: far
    image_size_px: [{0}, {1}]
    horizontal_fov_deg: 58
    look_at: {{eye_m: [-0.25, 2.0, 1.45], target_m: [0.0, 0.0, 0.38]}}
  - name: right
    image_size_px: [{0}, {1}]
    horizontal_fov_deg: 58
    look_at: {{eye_m: [2.0, -0.7, 1.55], target_m: [0.05, 0.0, 0.28]}}
)";

constexpr const char* kDeployment = R"(name: features
rig: rig.yaml
scene: scene.yaml
frame_rate_hz: 30
viewer:
  path:
    - {{t_s: 0, eye_m: [0.0, -0.75, 0.55], target_m: [0.0, 0.05, 0.2]}}
  horizontal_fov_deg: 65
  render_size_px: [{0}, {1}]
  recon_size_px: [{2}, {3}]
nodes:
  - {{name: capture, program: capture_node, sources: synthetic, synthetic: {{period_s: 4}}}}
  - {{name: recon, program: recon_node}}
  - {{name: simulation, program: sim_node}}
  - {{name: rendering, program: render_node, video: false}}
)";

}  // namespace

const std::vector<Feature>& features() {
  static const std::vector<Feature> all = {
      {"cloth", kCloth},
      {"bodies", bodies()},
      {"joints", kJoints},
      {"particles", kParticles},
      {"shadows", "shadows: {target_m: [0.0, 0.0, 0.1], fov_deg: 50}\n"},
      {"lit", "lights_real_objects: true\n"},
      {"history", "history: {max_speed_m_s: 4}\n"}};
  return all;
}

std::filesystem::path write_deployment(const std::filesystem::path& folder, const Feature& feature,
                                       ImageSize size) {
  const bool is_live = size == ImageSize::live;
  base::write_file(folder / "scene.yaml", kBaseScene + feature.scene_lines);
  base::write_file(folder / "rig.yaml", is_live ? fmt::format(fmt::runtime(kRig), 180, 122)
                                                : fmt::format(fmt::runtime(kRig), 720, 486));
  base::write_file(folder / "deployment.yaml",
                   is_live ? fmt::format(fmt::runtime(kDeployment), 320, 240, 160, 120)
                           : fmt::format(fmt::runtime(kDeployment), 640, 480, 320, 240));
  return folder / "deployment.yaml";
}

}  // namespace fivepipe::feature_bench
