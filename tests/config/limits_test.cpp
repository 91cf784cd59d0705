// The ranges and defaults of the keys, and the ranges in docs/configuration.md.
#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <regex>
#include <set>
#include <sstream>
#include <utility>

#include "tests/support/deployment_files.h"
#include "tests/support/source_text.h"
#include "tests/support/text.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

// Returns the problems without file, line and column.
std::vector<std::string> texts_of(std::vector<std::string> problems) {
  for (std::string& problem : problems) problem.erase(0, problem.find(": ") + 2);
  return problems;
}

class Limits : public test::DeploymentFile {
 protected:
  std::vector<std::string> scene_problems(const std::string& text) {
    return problems_of([&] { test::load_scene(write("scene.yaml", text)); });
  }
  Scene scene(const std::string& text) { return test::load_scene(write("scene.yaml", text)); }
};

// Each number is LOW.
const std::string kDeployment = R"(
name: d
rig: rig.yaml
scene: scene.yaml
domain: LOW
frame_rate_hz: LOW
viewer:
  path: [{t_s: LOW, eye_m: [0, -1, 0.5], target_m: [0, 0, 0.2]}]
  horizontal_fov_deg: LOW
  near_m: LOW
  far_m: LOW
  stereo: {eye_distance_m: LOW}
nodes:
  - name: c
    program: capture_node
    cores: [LOW]
    sources:
      left: {genicam: a, exposure_us: LOW, gain_db: LOW, background_frames: LOW}
      right: {video: plate.png, background: plate.png, first_frame: LOW}
    segmentation: {threshold_sigmas: LOW, threshold_floor_levels: LOW,
                   threshold_ceiling_levels: LOW, jitter_px: LOW, hysteresis: LOW,
                   moving_boxes: LOW, shadow_min_brightness: LOW, shadow_tint_degrees: LOW,
                   min_object_px: LOW,
                   max_hole_px: LOW, opening_px: LOW, closing_px: LOW, adaptation_s: LOW}
    synthetic: {seed: LOW, period_s: LOW, noise_sigma_levels: LOW, supersampling: LOW}
    max_frames_in_flight: LOW
    precomputed_frames: LOW
  - {name: r, program: recon_node, threads: LOW, sweep_planes: LOW, tile_columns: LOW,
     tile_rows: LOW, worker: LOW, workers: LOW}
  - {name: s, program: sim_node, threads: LOW, eps_m: LOW, spacing_m: LOW, viewport_px: LOW,
     window_px: LOW, step_s: LOW, max_points: LOW}
  - {name: w, program: render_node, still_frame: LOW}
)";
const std::string kScene = R"(
name: s
gravity_m_s2: LOW
background_rgb: [0, 1.01, 0]
history: {cell_m: LOW, window_frames: LOW, max_speed_m_s: LOW}
objects:
  - name: box
    box: {size_m: [1, 1, LOW], cell_m: LOW}
    position_m: [0, 0, 0]
    motion: dynamic
    mass_kg: LOW
    restitution: LOW
    friction: LOW
    velocity_m_s: [0, LOW, 0]
    pattern: checker
    pattern_size_m: LOW
    report:
      contacts: LOW
      response: {height_m: LOW, apex_angle_deg: LOW}
      proximity: {cap_m: LOW, tolerance_m: LOW}
    warmth: {cap_m: LOW, tolerance_m: LOW, heating_s: LOW, cooling_s: LOW}
  - name: ball
    sphere: {radius_m: LOW, subdivisions: LOW}
    position_m: [0, 0, 0]
  - name: curtain
    curtain: {width_m: LOW, height_m: LOW, columns: LOW, rows: LOW, fold_depth_m: LOW,
              fold_count: LOW}
    position_m: [0, 0, 0]
    motion: cloth
    cloth: {density_kg_m2: LOW, stretch_compliance_m_n: LOW, compression_compliance_m_n: LOW,
            shear_compliance_m_n: LOW, bending_compliance_1_nm: LOW, damping_s: LOW,
            air_drag_1_s: LOW, thickness_m: LOW, friction: LOW}
)";

TEST_F(Limits, EachNumberOfADeploymentHasItsRange) {
  write("plate.png", "any content");
  EXPECT_THAT(
      texts_of(problems(test::replaced_all(kDeployment, "LOW", "-1e9"))),
      ElementsAre(
          "domain must be from 0 to 230, is -1e9",
          "frame_rate_hz must be greater than 0 and at most 1000, is -1e9",
          "t_s must be at least 0, is -1e9", "horizontal_fov_deg must be from 1 to 170, is -1e9",
          "near_m must be from 0.001 to 10000, is -1e9",
          "far_m must be from 0.001 to 100000, is -1e9",
          "eye_distance_m must be greater than 0 and at most 1, is -1e9",
          "cores[0] must be from 0 to 1023, is -1e9",
          "exposure_us must be from 1 to 333000, is -1e9",
          "gain_db must be from -100 to 100, is -1e9",
          "background_frames must be from 1 to 128, is -1e9",
          "first_frame must be from 0 to 2147483647, is -1e9",
          "threshold_sigmas must be from 0 to 1000, is -1e9",
          "threshold_floor_levels must be from 0 to 255, is -1e9",
          "threshold_ceiling_levels must be from 0 to 255, is -1e9",
          "jitter_px must be from 0 to 10, is -1e9", "hysteresis must be from 1 to 10, is -1e9",
          "moving_boxes must be from 0 to 16, is -1e9",
          "shadow_min_brightness must be greater than 0 and at most 1, is -1e9",
          "shadow_tint_degrees must be from 0 to 45, is -1e9",
          "min_object_px must be from 0 to 1000000, is -1e9",
          "max_hole_px must be from 0 to 1000000, is -1e9",
          "opening_px must be from 0 to 64, is -1e9", "closing_px must be from 0 to 64, is -1e9",
          "adaptation_s must be from 0 to 86400, is -1e9",
          "seed must be from 0 to 9.007199255e+15, is -1e9",
          "period_s must be from 0.1 to 3600, is -1e9",
          "noise_sigma_levels must be from 0 to 255, is -1e9",
          "supersampling must be from 1 to 4, is -1e9",
          "max_frames_in_flight must be from 0 to 64, is -1e9",
          "precomputed_frames must be from 0 to 100000, is -1e9",
          "threads must be from 1 to 256, is -1e9", "sweep_planes must be from 2 to 4096, is -1e9",
          "tile_columns must be from 1 to 256, is -1e9", "tile_rows must be from 1 to 256, is -1e9",
          "worker must be from 0 to 2147483647, is -1e9",
          "workers must be from 1 to 2147483647, is -1e9", "threads must be from 1 to 256, is -1e9",
          "eps_m must be from 1e-06 to 0.1, is -1e9", "spacing_m must be from 1e-05 to 1, is -1e9",
          "viewport_px must be from 1 to 4096, is -1e9",
          "window_px must be from 1 to 16384, is -1e9",
          "step_s must be from 0.0001 to 0.1, is -1e9",
          "max_points must be from 1 to 1000000, is -1e9",
          "still_frame must be from 0 to 9.007199255e+15, is -1e9"));
}

TEST_F(Limits, EachNumberOfASceneHasItsRange) {
  EXPECT_THAT(
      texts_of(scene_problems(test::replaced_all(kScene, "LOW", "-1e9"))),
      ElementsAre(
          "gravity_m_s2 must be from 0 to 1000, is -1e9",
          "background_rgb[1] must be from 0 to 1, is 1.01",
          "cell_m must be from 0.0005 to 1, is -1e9",
          "window_frames must be from 3 to 240, is -1e9",
          "max_speed_m_s must be from 0.01 to 1000, is -1e9",
          "size_m[2] must be greater than 0 and at most 10000, is -1e9",
          "cell_m must be greater than 0 and at most 10000, is -1e9",
          "mass_kg must be greater than 0 and at most 1000000, is -1e9",
          "restitution must be from 0 to 1, is -1e9", "friction must be from 0 to 10, is -1e9",
          "velocity_m_s[1] must be from -100 to 100, is -1e9",
          "pattern_size_m must be greater than 0 and at most 10000, is -1e9",
          "contacts must be from 0 to 64, is -1e9", "height_m must be from 0.0001 to 10, is -1e9",
          "apex_angle_deg must be from 0.1 to 179.9, is -1e9",
          "cap_m must be from 0.001 to 10, is -1e9", "tolerance_m must be from 1e-05 to 1, is -1e9",
          "cap_m must be from 0.001 to 10, is -1e9", "tolerance_m must be from 1e-05 to 1, is -1e9",
          "heating_s must be from 0.001 to 3600, is -1e9",
          "cooling_s must be from 0.001 to 3600, is -1e9",
          "radius_m must be greater than 0 and at most 10000, is -1e9",
          "subdivisions must be from 0 to 6, is -1e9",
          "width_m must be greater than 0 and at most 10000, is -1e9",
          "height_m must be greater than 0 and at most 10000, is -1e9",
          "columns must be from 1 to 1000, is -1e9", "rows must be from 1 to 1000, is -1e9",
          "fold_depth_m must be from 0 to 10, is -1e9",
          "fold_count must be from 0 to 1000, is -1e9",
          "density_kg_m2 must be from 0.001 to 100, is -1e9",
          "stretch_compliance_m_n must be from 0 to 1000000000, is -1e9",
          "compression_compliance_m_n must be from 0 to 1000000000, is -1e9",
          "shear_compliance_m_n must be from 0 to 1000000000, is -1e9",
          "bending_compliance_1_nm must be from 0 to 1000000000, is -1e9",
          "damping_s must be from 0 to 10, is -1e9", "air_drag_1_s must be from 0 to 1000, is -1e9",
          "thickness_m must be from 0 to 0.1, is -1e9", "friction must be from 0 to 10, is -1e9"));
  EXPECT_TRUE(test::contains(
      scene_problems(test::kGoodScene + "    report: {response: {v_rec: [0, 1, -2e6]}}\n"),
      "v_rec[2] must be from -1000000 to 1000000, is -2e6"));
}

// The document has "LOW to HIGH" or "> LOW, at most HIGH" in the line of a key.
TEST_F(Limits, TheDocumentStatesTheRangeOfEachNumber) {
  write("plate.png", "any content");
  std::vector<std::string> lines;
  std::istringstream document(test::text_of("docs/configuration.md"));
  for (std::string line; std::getline(document, line);) lines.push_back(line);
  const std::regex in_problem(
      R"((\w+)(\[\d\])* must be (from|greater than) (\S+) (?:to|and at most) ([^ ,]+), is .*)"),
      in_document(R"((> )?(-?[0-9][0-9.e+-]*)(?: to |, at most )([0-9][0-9.e+-]*))");
  std::vector<std::string> not_stated;
  int ranges = 0;
  for (const auto& texts : {texts_of(problems(test::replaced_all(kDeployment, "LOW", "-1e9"))),
                            texts_of(scene_problems(test::replaced_all(kScene, "LOW", "-1e9")))})
    for (const std::string& problem : texts) {
      std::smatch range;
      if (!std::regex_match(problem, range, in_problem)) continue;
      const bool is_stated = std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
        if (!test::contains(line, "`" + range.str(1) + "`")) return false;
        return std::any_of(std::sregex_iterator(line.begin(), line.end(), in_document),
                           std::sregex_iterator(), [&](const std::smatch& stated) {
                             return stated[1].matched == (range[3] == "greater than") &&
                                    std::stod(stated[2]) == std::stod(range[4]) &&
                                    std::stod(stated[3]) == std::stod(range[5]);
                           });
      });
      if (!is_stated) not_stated.push_back(range[1]);
      ++ranges;
    }
  // A colour is from 0 to 1 everywhere. The limits of the others are far from their use, or other
  // keys and files.
  EXPECT_THAT(not_stated,
              ElementsAre("first_frame", "seed", "worker", "workers", "still_frame",
                          "background_rgb", "size_m", "cell_m", "radius_m", "width_m", "height_m"));
  EXPECT_GT(ranges, 50);
}

// The cells of each row of a document's tables, without the markup of code.
std::vector<std::vector<std::string>> rows_of(const char* document) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(test::text_of(document));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| ")) continue;
    std::erase(line, '`');
    std::vector<std::string>& cells = rows.emplace_back();
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) {
      cell.erase(0, cell.find_first_not_of(' '));
      cells.push_back(cell.substr(0, cell.find_last_not_of(' ') + 1));
    }
  }
  return rows;
}

TEST(FootageDocument, StatesTheDefaultsOfTheReference) {
  std::map<std::string, std::string> defaults;  // key, type or unit, default
  for (const auto& cells : rows_of("docs/configuration.md"))
    if (cells.size() == 5) {
      std::istringstream keys(cells[0]);
      for (std::string key; std::getline(keys, key, ',');)
        defaults.emplace(test::replaced_all(key, " ", ""), cells[2]);
    }
  int compared = 0;
  std::set<std::string> described;
  for (const auto& cells : rows_of("docs/footage.md")) {
    if (cells.size() != 3) continue;
    std::istringstream keys(cells[0]);
    for (std::string key; std::getline(keys, key, ',');) {
      key = test::replaced_all(key, " ", "");
      described.insert(key);
      // These are also keys of something else, with another default.
      if (std::set<std::string>{"volume_m", "cameras", "video", "rate_hz"}.contains(key)) continue;
      if (!defaults.contains(key)) continue;
      EXPECT_EQ(cells[1], defaults.at(key)) << key;
      ++compared;
    }
  }
  EXPECT_GE(compared, 30);
  for (const char* key : {"threshold_sigmas",
                          "threshold_floor_levels",
                          "threshold_ceiling_levels",
                          "jitter_px",
                          "hysteresis",
                          "moving_boxes",
                          "gain_compensation",
                          "shadow_min_brightness",
                          "shadow_tint_degrees",
                          "min_object_px",
                          "max_hole_px",
                          "opening_px",
                          "closing_px",
                          "conservative",
                          "adaptation_s",
                          "cameras",
                          "volume_m",
                          "regions",
                          "name",
                          "image_size_px",
                          "fx_px",
                          "cx_px",
                          "distortion",
                          "camera_from_world",
                          "camera_from_viewer",
                          "published",
                          "gives_shape",
                          "gives_colour",
                          "mount",
                          "video",
                          "first_frame",
                          "background",
                          "background_frames",
                          "matte",
                          "alpha",
                          "chroma_key",
                          "format",
                          "rate_hz",
                          "exposure_us"})
    EXPECT_TRUE(described.contains(key)) << key;
}

TEST_F(Limits, AnAbsentKeyOfADeploymentHasItsDefault) {
  write("plate.png", "any content");
  const Deployment d = load(with_nodes(R"(  - name: c
    program: capture_node
    sources:
      left: {v4l2: 0}
      right: {video: plate.png, background: plate.png}
    segmentation: {}
    synthetic: {}
  - {name: r, program: recon_node}
  - {name: s, program: sim_node}
  - {name: w, program: render_node}
)"));
  EXPECT_EQ(d.domain, 0u);
  EXPECT_EQ(d.network_profile, "loopback");
  EXPECT_EQ(d.frame_rate_hz, 30);
  EXPECT_EQ(d.viewer.name, "viewer");
  EXPECT_EQ(d.viewer.path.at(0).t_s, 0);
  EXPECT_NEAR(d.viewer.horizontal_fov_rad, 1, 1e-15);
  EXPECT_EQ(d.viewer.render_width_px, 640);
  EXPECT_EQ(d.viewer.render_height_px, 480);
  EXPECT_EQ(d.viewer.recon_width_px, 320);
  EXPECT_EQ(d.viewer.recon_height_px, 240);
  EXPECT_EQ(d.viewer.near_m, 0.05);
  EXPECT_EQ(d.viewer.far_m, 5);
  EXPECT_FALSE(d.viewer.eye_distance_m);
  ASSERT_EQ(d.nodes.size(), 4u);

  const auto& capture = std::get<CaptureConfig>(d.nodes[0].config);
  EXPECT_EQ(std::get<V4l2Source>(capture.sources.at("left")).format, "");
  EXPECT_FALSE(std::get<V4l2Source>(capture.sources.at("left")).rate_hz);
  EXPECT_EQ(std::get<LearnedBackground>(std::get<V4l2Source>(capture.sources.at("left")).key).file,
            "");
  EXPECT_EQ(
      std::get<LearnedBackground>(std::get<V4l2Source>(capture.sources.at("left")).key).frames, 30);
  EXPECT_EQ(std::get<VideoSource>(capture.sources.at("right")).first_frame, 0);
  EXPECT_EQ(capture.segmentation.threshold_sigmas, 4);
  EXPECT_EQ(capture.segmentation.threshold_floor_levels, 8);
  EXPECT_EQ(capture.segmentation.threshold_ceiling_levels, 16);
  EXPECT_EQ(capture.segmentation.jitter_px, 0.2);
  EXPECT_EQ(capture.segmentation.hysteresis, 2);
  EXPECT_EQ(capture.segmentation.moving_boxes, 4);
  EXPECT_TRUE(capture.segmentation.gain_compensation);
  EXPECT_EQ(capture.segmentation.shadow_min_brightness, 0.5);
  EXPECT_EQ(capture.segmentation.shadow_tint_degrees, 2);
  EXPECT_EQ(capture.segmentation.min_object_px, 30);
  EXPECT_EQ(capture.segmentation.max_hole_px, 50);
  EXPECT_EQ(capture.segmentation.opening_px, 0);
  EXPECT_EQ(capture.segmentation.closing_px, 0);
  EXPECT_FALSE(capture.segmentation.conservative);
  EXPECT_EQ(capture.segmentation.adaptation_s, 0);
  EXPECT_FALSE(capture.segmentation.volume_m);
  EXPECT_TRUE(capture.segmentation.regions.empty());
  EXPECT_EQ(capture.synthetic.seed, 1u);
  EXPECT_EQ(capture.synthetic.period_s, 4);
  EXPECT_EQ(capture.synthetic.noise_sigma_levels, 2);
  EXPECT_TRUE(capture.synthetic.cast_shadow);
  EXPECT_FALSE(capture.synthetic.prerender);
  EXPECT_EQ(capture.synthetic.supersampling, 1);
  EXPECT_TRUE(capture.loop);
  EXPECT_EQ(capture.lost_camera, LostCamera::drop);
  EXPECT_EQ(capture.max_frames_in_flight, 3);
  EXPECT_EQ(capture.precomputed_frames, 0);

  const auto& recon = std::get<ReconConfig>(d.nodes[1].config);
  EXPECT_EQ(recon.backend, HullBackend::automatic);
  EXPECT_EQ(recon.threads, 1);
  EXPECT_EQ(recon.sweep_planes, 64);
  EXPECT_EQ(recon.tile_columns, 8);
  EXPECT_EQ(recon.tile_rows, 6);
  EXPECT_EQ(recon.worker_index, 0);
  EXPECT_EQ(recon.worker_count, 1);
  EXPECT_EQ(recon.split, ReconSplit::tiles);
  EXPECT_TRUE(recon.balance);

  const auto& sim = std::get<SimConfig>(d.nodes[2].config);
  EXPECT_EQ(sim.collision, CollisionBackend::cpu);
  EXPECT_EQ(sim.threads, 1);
  EXPECT_EQ(sim.eps_m, 0.0005);
  EXPECT_EQ(sim.spacing_m, 0.003);
  EXPECT_EQ(sim.viewport_px, 10);
  EXPECT_EQ(sim.window_px, 400);
  EXPECT_EQ(sim.step_s, 1.0 / 240);
  EXPECT_EQ(sim.max_points, 256);

  const auto& render = std::get<RenderConfig>(d.nodes[3].config);
  EXPECT_FALSE(render.window);
  EXPECT_TRUE(render.video);
  EXPECT_EQ(render.still_frame, 0);
}

TEST_F(Limits, AnAbsentKeyOfASceneHasItsDefault) {
  const Scene s = scene(R"(
name: s
history: {}
objects:
  - name: box
    box: {size_m: [1, 2, 3]}
    position_m: [4, 5, 6]
    report: {response: {}, proximity: {}}
    warmth: {}
  - name: ball
    sphere: {radius_m: 1}
    position_m: [0, 0, 0]
  - name: curtain
    curtain: {width_m: 1, height_m: 2, columns: 3, rows: 4}
    position_m: [0, 0, 0]
    motion: cloth
)");
  EXPECT_EQ(s.gravity_m_s2, 9.80665);
  EXPECT_EQ(s.light_world_m, Eigen::Vector3d(0, 0, 3));
  EXPECT_EQ(s.background_rgb, (std::array{0.1, 0.12, 0.15}));
  EXPECT_EQ(s.history->cell_m, 0.005);
  EXPECT_EQ(s.history->window_frames, 8);
  EXPECT_EQ(s.history->max_speed_m_s, 6);
  ASSERT_EQ(s.objects.size(), 3u);

  const SceneObject& box = s.objects[0];
  EXPECT_EQ(mesh_of(box).triangles.size(), 12u) << "one cell per face";
  EXPECT_EQ(box.world_from_object.translation(), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(box.world_from_object.linear(), Eigen::Matrix3d::Identity());
  EXPECT_EQ(box.motion, Motion::fixed);
  EXPECT_EQ(box.reaction, Reaction::highlight);
  EXPECT_EQ(box.mass_kg, 1);
  EXPECT_EQ(box.restitution, 0.5);
  EXPECT_EQ(box.friction, 0.5);
  EXPECT_EQ(box.velocity_world_m_s, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(box.colour_rgb, (std::array{0.8, 0.8, 0.8}));
  EXPECT_EQ(box.pattern, Pattern::plain);
  EXPECT_EQ(box.pattern_size_m, 0.1);
  EXPECT_FALSE(box.requests.triangles || box.requests.first_contact);
  EXPECT_EQ(box.requests.contacts, 0);
  EXPECT_EQ(box.requests.response->search, RecoverySearch::from_reference);
  EXPECT_EQ(box.requests.response->height_m, 0.05);
  EXPECT_NEAR(box.requests.response->apex_angle_rad, std::numbers::pi / 18, 1e-9);
  EXPECT_FALSE(box.requests.response->v_rec_world);
  EXPECT_FALSE(box.requests.response->four_points || box.requests.response->closed_form ||
               box.requests.response->local_minimum_translation);
  EXPECT_EQ(box.requests.proximity->of, ProximityOf::vertices);
  EXPECT_EQ(box.requests.proximity->cap_m, 0.05);
  EXPECT_EQ(box.requests.proximity->tolerance_m, 0.002);
  EXPECT_EQ(box.warming->cap_m, 0.06);
  EXPECT_EQ(box.warming->tolerance_m, 0.005);
  EXPECT_EQ(box.warming->heating_s, 0.5);
  EXPECT_EQ(box.warming->cooling_s, 4);
  EXPECT_EQ(box.warming->colour_rgb, (std::array{1.0, 0.25, 0.02}));

  EXPECT_EQ(mesh_of(s.objects[1]).triangles.size(), 20u * 16);
  EXPECT_EQ(geometry::bounds_m(mesh_of(s.objects[2])).sizes(), Eigen::Vector3d(1, 0, 2))
      << "a curtain without folds";
  const ClothSettings& cloth = *s.objects[2].cloth;
  EXPECT_EQ(s.objects[2].reaction, Reaction::yield);
  EXPECT_EQ(cloth.density_kg_m2, 0.2);
  EXPECT_EQ(cloth.stretch_compliance_m_n, 1e-5);
  EXPECT_EQ(cloth.compression_compliance_m_n, 1.0);
  EXPECT_EQ(cloth.shear_compliance_m_n, 1e-3);
  EXPECT_EQ(cloth.bending_compliance_1_nm, 1.7e4);
  EXPECT_EQ(cloth.damping_s, 1e-3);
  EXPECT_EQ(cloth.air_drag_1_s, 1);
  EXPECT_EQ(cloth.thickness_m, 0.002);
  EXPECT_EQ(cloth.friction, 0.3);
  EXPECT_FALSE(cloth.self_collision);
  EXPECT_FALSE(cloth.object_collision);
  EXPECT_FALSE(cloth.v_rec_world);
  EXPECT_TRUE(cloth.pins.empty());
}

TEST_F(Limits, AClothHasAtMost100000Triangles) {
  const auto problems_of = [&](const std::string& cells) {
    return texts_of(
        scene_problems("name: s\nobjects:\n  - name: a\n    curtain: {width_m: 1, height_m: 1, " +
                       cells + "}\n    position_m: [0, 0, 1]\n    motion: cloth\n"));
  };
  EXPECT_THAT(problems_of("columns: 250, rows: 200"), ElementsAre());
  EXPECT_THAT(problems_of("columns: 1000, rows: 51"),
              ElementsAre("the cloth has 102000 triangles, at most 100000 can be simulated: use a "
                          "coarser mesh"));
}

TEST_F(Limits, EachRequestAloneNeedsAReaction) {
  const auto problems_of_report = [&](const std::string& report) {
    return texts_of(scene_problems(test::kGoodScene + "    reaction: none\n    report: {" + report +
                                   "}\nhistory: {}\n"));
  };
  EXPECT_THAT(problems_of_report(""), ElementsAre());
  for (const std::string only :
       {"triangles: true", "response: {}", "contacts: 1", "proximity: {}", "first_contact: true"})
    EXPECT_THAT(problems_of_report(only),
                ElementsAre("report has no effect with reaction none: the object is not queried"))
        << only;
}

TEST_F(Limits, AToleranceIsFromAThousandthOfItsCapToTheCap) {
  const auto with = [&](const std::string& proximity) {
    return test::kGoodScene + "    report: {proximity: {" + proximity + "}}\n";
  };
  EXPECT_EQ(scene(with("cap_m: 0.001")).objects[0].requests.proximity->tolerance_m, 0.001)
      << "the default is at most the cap";
  EXPECT_EQ(scene(with("cap_m: 10, tolerance_m: 0.01")).objects[0].requests.proximity->tolerance_m,
            0.01);
  EXPECT_EQ(scene_problems(with("cap_m: 10, tolerance_m: 0.0099")).size(), 1u);
  EXPECT_EQ(scene_problems(with("cap_m: 0.5, tolerance_m: 0.501")).size(), 1u);
}

// 2 (1 * 2 + 2 * 166666 + 166666 * 1) = 1e6 cells of 2^-7 m, and one more layer.
TEST_F(Limits, ABoxHasAtMostAMillionCells) {
  for (int turn = 0; turn < 3; ++turn)
    for (const int length : {166666, 166667}) {
      std::array<int, 3> cells{1, 2, length};
      std::rotate(cells.begin(), cells.begin() + turn, cells.end());
      std::string size_m;  // 2^-7 = 78125e-7
      for (const int count : cells)
        size_m += (size_m.empty() ? "" : ", ") + std::to_string(count * 78125LL) + "e-7";
      const auto found = scene_problems(
          "name: s\nobjects:\n  - name: a\n    position_m: [0, 0, 0]\n    box: {size_m: [" +
          size_m + "], cell_m: 78125e-7}\n");
      EXPECT_EQ(found.size(), length == 166666 ? 0u : 1u) << size_m;
    }
}

// The rig's volume is 1 m wide. 512^3 cells are 2^27.
TEST_F(Limits, AHistoryHasAtMost2To27Cells) {
  write("scene.yaml", test::kGoodScene + "history: {cell_m: 0.001953125}\n");
  EXPECT_THAT(problems(test::kGoodDeployment), ElementsAre());
  write("scene.yaml", test::kGoodScene + "history: {cell_m: 0.001953}\n");
  EXPECT_THAT(problems(test::kGoodDeployment),
              ElementsAre("deployment.yaml:3:8: history.cell_m of the scene splits the rig's "
                          "volume_m into 1.35e+08 cells, the limit is 1.342e+08: increase cell_m "
                          "or reduce volume_m"));
}

TEST_F(Limits, MeshesFrom5MillimetresTo20MetresArePlausible) {
  for (const auto& [size, is_plausible] :
       {std::pair{"5", true}, {"4.999", false}, {"20000", true}, {"20001", false}}) {
    const std::string s = size;
    write("part.ply",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
          "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n" +
              s + " 0 0\n0 " + s + " 0\n3 0 1 2\n");
    const Scene loaded = scene(
        "name: m\nobjects:\n  - name: part\n    position_m: [0, 0, 0]\n    mesh: {file: part.ply, "
        "unit: mm}\n");
    EXPECT_EQ(mesh_warnings(loaded).empty(), is_plausible) << size;
  }
}

TEST_F(Limits, NamesHaveAtMost32CharactersAndThoseOfObjects64) {
  const auto with_name = [&](std::size_t length) {
    return test::replaced(test::kGoodDeployment, "name: small",
                          "name: " + std::string(length, 'a'));
  };
  EXPECT_THAT(problems(with_name(32)), ElementsAre());
  EXPECT_THAT(texts_of(problems(with_name(33))),
              ElementsAre("name has 33 characters, the limit is 32"));
  EXPECT_THAT(scene_problems(test::replaced(test::kGoodScene, "- name: block",
                                            "- name: " + std::string(64, 'b'))),
              ElementsAre());
}

}  // namespace
}  // namespace fivepipe::config
