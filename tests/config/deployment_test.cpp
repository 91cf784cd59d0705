#include "common/config/deployment.h"

#include <sys/stat.h>

#include <algorithm>
#include <numbers>

#include "tests/support/deployment_files.h"
#include "tests/support/text.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

using DeploymentFile = test::DeploymentFile;

TEST_F(DeploymentFile, RejectsTooManyHistoryCells) {
  write("scene.yaml", test::kGoodScene + "history: {cell_m: 0.0005}\n");
  EXPECT_THAT(
      problems(with_nodes("  - {name: s, program: sim_node}\n")),
      ElementsAre(testing::AllOf(
          testing::HasSubstr(
              "deployment.yaml:3:8: history.cell_m of the scene splits the rig's volume_m into"),
          testing::HasSubstr("increase cell_m or reduce volume_m"))));
  write("scene.yaml", test::kGoodScene + "history: {cell_m: 0.01}\n");
  EXPECT_TRUE(problems(with_nodes("  - {name: s, program: sim_node}\n")).empty());
}

TEST_F(DeploymentFile, AcceptsTheDomainsThatNodesAccept) {
  EXPECT_EQ(load(test::kGoodDeployment + "domain: 230\n").domain, 230u);
  for (const char* domain : {"231", "232"})
    EXPECT_THAT(problems(test::kGoodDeployment + "domain: " + domain + "\n"),
                ElementsAre(testing::ContainsRegex("deployment.yaml:[0-9]+:9: domain .*" +
                                                   std::string(domain))))
        << domain;
}

TEST_F(DeploymentFile, LeavesOutCamerasOfTheRig) {
  const Deployment d = load(test::kGoodDeployment + "without_cameras: [left]\n");
  ASSERT_EQ(d.rig.cameras.size(), 1u);
  EXPECT_EQ(d.rig.cameras[0].name, "right");
  EXPECT_EQ(std::get<CaptureConfig>(d.nodes[0].config).sources.size(), 1u);
  // Its source may stay in the file, and need not exist.
  const std::string sources =
      "sources: {left: {video: none.avi, background: none.avi}, right: synthetic}";
  const Deployment named =
      load(test::replaced(test::kGoodDeployment, "sources: synthetic", sources) +
           "without_cameras: [left]\n");
  EXPECT_EQ(std::get<CaptureConfig>(named.nodes[0].config).sources.count("left"), 0u);
  EXPECT_THAT(
      problems(test::kGoodDeployment + "without_cameras: [far, left, left]\n"),
      ElementsAre(
          "deployment.yaml:13:19: without_cameras[0] must be one of left, right; is \"far\"",
          "deployment.yaml:13:30: without_cameras[2] repeats left: remove it"));
  EXPECT_THAT(
      problems(test::kGoodDeployment + "without_cameras: [left, right]\n"),
      ElementsAre("deployment.yaml:13:18: without_cameras leaves no camera that gives shape"));
}

TEST_F(DeploymentFile, UsesDefaultsForMissingKeys) {
  const Deployment d = load(test::kGoodDeployment);
  EXPECT_EQ(d.name, "small");
  EXPECT_EQ(d.domain, 0u);
  EXPECT_EQ(d.frame_rate_hz, 30);
  EXPECT_EQ(d.rig.name, "two");
  EXPECT_EQ(d.scene.name, "block");
  ASSERT_EQ(d.nodes.size(), 2u);
  const auto& capture = std::get<CaptureConfig>(d.nodes[0].config);
  ASSERT_EQ(capture.sources.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<SyntheticSource>(capture.sources.at("left")));
  EXPECT_EQ(capture.synthetic.period_s, SyntheticWorld().period_s);
  EXPECT_EQ(std::get<ReconConfig>(d.nodes[1].config).worker_count, 1);
  EXPECT_TRUE(d.nodes[0].cores.empty());
  EXPECT_EQ(d.nodes[1].line, 11);
}

// A deployment file with every key.
const std::string kFullDeployment = R"(
name: full
rig: rig.yaml
scene: scene.yaml
domain: 7
network_profile: loopback
security: {keys: keys}
frame_rate_hz: 25
viewer:
  name: anna
  path:
    - {t_s: 0, eye_m: [0, -1, 0.5], target_m: [0, 0, 0.2]}
    - {t_s: 2.5, eye_m: [0.1, -1, 0.5], target_m: [0, 0, 0.2]}
  horizontal_fov_deg: 90
  render_size_px: [800, 600]
  recon_size_px: [400, 300]
  near_m: 0.1
  far_m: 4
  stereo: {eye_distance_m: 0.063}
nodes:
  - name: files
    program: capture_node
    host: far_away
    cores: [2, 3]
    sources:
      left: {v4l2: /dev/v4l/by-id/some-camera, format: MJPG, rate_hz: 60, background_frames: 12}
    loop: false
    lost_camera: continue
  - name: film
    program: capture_node
    sources:
      right: {video: film_%04d.png, background: plate.png, first_frame: 3}
    segmentation:
      threshold_sigmas: 5
      threshold_floor_levels: 10
      threshold_ceiling_levels: 30
      jitter_px: 0.5
      hysteresis: 3
      moving_boxes: 7
      gain_compensation: false
      shadow_min_brightness: 1
      shadow_tint_degrees: 4
      cameras: {right: {threshold_floor_levels: 12, max_hole_px: 9}}
      min_object_px: 11
      max_hole_px: 22
      opening_px: 1
      closing_px: 2
      conservative: true
      adaptation_s: 60
      volume_m: {min: [-1, -2, -3], max: [1, 2, 3]}
      regions: {right: plate.png}
    synthetic: {seed: 9, period_s: 2, noise_sigma_levels: 0, cast_shadow: false, prerender: true,
      supersampling: 3}
    max_frames_in_flight: 0
    precomputed_frames: 60
  - name: a
    program: recon_node
    backend: sweep
    threads: 3
    sweep_planes: 128
    tile_columns: 2
    tile_rows: 1
    worker: 1
    workers: 2
    split: frames
    balance: false
  - name: b
    program: recon_node
    tile_columns: 2
    tile_rows: 1
    worker: 0
    workers: 2
    split: frames
    balance: false
  - name: s
    program: sim_node
    collision: paper
    threads: 4
    eps_m: 0.001
    spacing_m: 0.004
    viewport_px: 20
    window_px: 200
    step_s: 0.005
    max_points: 8
  - name: r
    program: render_node
    window: true
    video: false
    still_frame: 10
)";

class FullDeployment : public test::DeploymentFile {
 protected:
  FullDeployment() {
    write("film_0003.png", "any content");
    write("plate.png", "any content");
    d = load(kFullDeployment);
  }
  Deployment d;
};

TEST_F(FullDeployment, HasTheKeysOfDeploymentAndViewer) {
  EXPECT_EQ(d.domain, 7u);
  EXPECT_EQ(d.network_profile, "loopback");
  EXPECT_EQ(d.frame_rate_hz, 25);
  EXPECT_EQ(d.viewer.name, "anna");
  ASSERT_EQ(d.viewer.path.size(), 2u);
  EXPECT_EQ(d.viewer.path[1].t_s, 2.5);
  EXPECT_NEAR(d.viewer.horizontal_fov_rad, std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(d.viewer.render_height_px, 600);
  EXPECT_EQ(d.viewer.recon_width_px, 400);
  EXPECT_EQ(d.viewer.far_m, 4);
  EXPECT_EQ(d.viewer.eye_distance_m, 0.063);
}

TEST_F(FullDeployment, CapturesTheCamerasOfAllItsCaptureNodes) {
  EXPECT_EQ(first_capture_node(d), d.nodes.data());
  const CaptureConfig all = capture_of_all_nodes(d);
  EXPECT_EQ(all.sources.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<V4l2Source>(all.sources.at("left")));
  EXPECT_TRUE(std::holds_alternative<VideoSource>(all.sources.at("right")));
  EXPECT_EQ(all.segmentation_for("left").threshold_floor_levels, 8) << "that of its own node";
  EXPECT_EQ(all.segmentation_for("right").threshold_floor_levels, 12);
  EXPECT_EQ(all.lost_camera, LostCamera::go_on) << "as the first node";
  const CaptureConfig once = without_clock(all);
  EXPECT_FALSE(once.loop);
  EXPECT_EQ(once.precomputed_frames, 0);
  EXPECT_EQ(first_capture_node({}), nullptr);
  EXPECT_THROW(capture_of_all_nodes({}), std::runtime_error);
}

TEST_F(FullDeployment, HasTheKeysOfItsCaptureNodes) {
  ASSERT_EQ(d.nodes.size(), 6u);
  EXPECT_EQ(d.nodes[0].host, "far_away");
  EXPECT_EQ(d.nodes[0].cores, (std::vector<int>{2, 3}));
  const auto& files = std::get<CaptureConfig>(d.nodes[0].config);
  EXPECT_FALSE(files.loop);
  EXPECT_EQ(files.lost_camera, LostCamera::go_on);
  EXPECT_EQ(std::get<V4l2Source>(files.sources.at("left")).device, "/dev/v4l/by-id/some-camera");
  EXPECT_EQ(std::get<V4l2Source>(files.sources.at("left")).format, "MJPG");
  EXPECT_EQ(std::get<V4l2Source>(files.sources.at("left")).rate_hz, 60);
  EXPECT_EQ(std::get<LearnedBackground>(std::get<V4l2Source>(files.sources.at("left")).key).frames,
            12);
  const auto& film = std::get<CaptureConfig>(d.nodes[1].config);
  EXPECT_EQ(std::get<VideoSource>(film.sources.at("right")).file,
            (folder() / "film_%04d.png").string());
  EXPECT_EQ(std::get<LearnedBackground>(std::get<VideoSource>(film.sources.at("right")).key).file,
            (folder() / "plate.png").string());
  EXPECT_EQ(std::get<VideoSource>(film.sources.at("right")).first_frame, 3);
  EXPECT_EQ(film.segmentation.threshold_sigmas, 5);
  EXPECT_EQ(film.segmentation.threshold_floor_levels, 10);
  EXPECT_EQ(film.segmentation.shadow_min_brightness, 1);
  EXPECT_EQ(film.segmentation.shadow_tint_degrees, 4);
  ASSERT_EQ(film.segmentation_of.size(), 1u);
  const SegmentationConfig& of_right = film.segmentation_for("right");
  EXPECT_EQ(of_right.threshold_floor_levels, 12);
  EXPECT_EQ(of_right.max_hole_px, 9);
  EXPECT_EQ(of_right.shadow_tint_degrees, 4) << "inherited";
  EXPECT_EQ(film.segmentation_for("left").threshold_floor_levels, 10);
  EXPECT_EQ(film.segmentation.threshold_ceiling_levels, 30);
  EXPECT_EQ(film.segmentation.jitter_px, 0.5);
  EXPECT_EQ(film.segmentation.hysteresis, 3);
  EXPECT_EQ(film.segmentation.moving_boxes, 7);
  EXPECT_FALSE(film.segmentation.gain_compensation);
  EXPECT_EQ(film.segmentation.min_object_px, 11);
  EXPECT_EQ(film.segmentation.max_hole_px, 22);
  EXPECT_EQ(film.segmentation.opening_px, 1);
  EXPECT_EQ(film.segmentation.closing_px, 2);
  EXPECT_TRUE(film.segmentation.conservative);
  EXPECT_EQ(film.segmentation.adaptation_s, 60);
  ASSERT_TRUE(film.segmentation.volume_m);
  EXPECT_EQ(film.segmentation.volume_m->min(), Eigen::Vector3d(-1, -2, -3));
  EXPECT_EQ(film.segmentation.volume_m->max(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(film.segmentation.regions,
            (std::map<std::string, std::string>{{"right", (folder() / "plate.png").string()}}));
  EXPECT_EQ(film.synthetic.seed, 9u);
  EXPECT_EQ(film.synthetic.period_s, 2);
  EXPECT_EQ(film.synthetic.noise_sigma_levels, 0);
  EXPECT_FALSE(film.synthetic.cast_shadow);
  EXPECT_TRUE(film.synthetic.prerender);
  EXPECT_EQ(film.synthetic.supersampling, 3);
  EXPECT_EQ(film.max_frames_in_flight, 0);
  EXPECT_EQ(film.precomputed_frames, 60);
}

TEST_F(FullDeployment, HasTheKeysOfItsOtherNodes) {
  ASSERT_EQ(d.nodes.size(), 6u);
  const auto& a = std::get<ReconConfig>(d.nodes[2].config);
  EXPECT_EQ(a.backend, HullBackend::sweep);
  EXPECT_EQ(a.sweep_planes, 128);
  EXPECT_EQ(a.tile_columns, 2);
  EXPECT_EQ(a.threads, 3);
  EXPECT_EQ(a.tile_rows, 1);
  EXPECT_EQ(a.worker_index, 1);
  EXPECT_EQ(a.worker_count, 2);
  EXPECT_EQ(a.split, ReconSplit::frames);
  EXPECT_FALSE(a.balance);
  const auto& s = std::get<SimConfig>(d.nodes[4].config);
  EXPECT_EQ(s.collision, CollisionBackend::paper);
  EXPECT_EQ(s.eps_m, 0.001);
  EXPECT_EQ(s.spacing_m, 0.004);
  EXPECT_EQ(s.threads, 4);
  EXPECT_EQ(s.viewport_px, 20);
  EXPECT_EQ(s.window_px, 200);
  EXPECT_EQ(s.step_s, 0.005);
  EXPECT_EQ(s.max_points, 8);
  const auto& r = std::get<RenderConfig>(d.nodes[5].config);
  EXPECT_TRUE(r.window);
  EXPECT_FALSE(r.video);
  EXPECT_EQ(r.still_frame, 10);
}

TEST_F(FullDeployment, FindsNodesAndTheirPrograms) {
  ASSERT_EQ(d.nodes.size(), 6u);
  EXPECT_EQ(program_of(d.nodes[0]), "capture_node");
  EXPECT_EQ(program_of(d.nodes[2]), "recon_node");
  EXPECT_EQ(program_of(d.nodes[4]), "sim_node");
  EXPECT_EQ(program_of(d.nodes[5]), "render_node");
  EXPECT_EQ(find_node(d, "s"), &d.nodes[4]);
  EXPECT_EQ(find_node(d, "x"), nullptr);
}

TEST_F(DeploymentFile, ReadsTheHeadPathFromAFile) {
  write("head.csv",
        "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m\n0,0,-1,0.5,0,0,0\n1,0.1,-1,"
        "0.5,0,0,0\n");
  const std::string text =
      "name: small\nrig: rig.yaml\nscene: scene.yaml\nviewer: {file: head.csv}\nnodes:\n  - {name: "
      "s, program: sim_node}\n";
  EXPECT_EQ(load(text).viewer.path.size(), 2u);
  write("head.csv", "t_s\n");
  EXPECT_TRUE(test::contains(problems(text), "head.csv:1:4: the first line must be"));
}

TEST_F(DeploymentFile, CommandLineOverridesSettings) {
  const std::string text = "settings: {rate: 12, place: .}\n" + test::kGoodDeployment.substr(1) +
                           "frame_rate_hz: ${rate}\n";
  EXPECT_EQ(load(text).frame_rate_hz, 12);
  EXPECT_EQ(load(text, {{"rate", "15"}}).frame_rate_hz, 15);
  EXPECT_THAT(problems(text, {{"rate", "fast"}}),
              ElementsAre("deployment.yaml:14:16: frame_rate_hz must be a number, is \"fast\""));
  EXPECT_THAT(
      problems(text, {{"rat", "15"}}),
      ElementsAre("deployment.yaml:1:11: --set rat: unknown setting; known settings: place, rate"));
  EXPECT_THAT(
      problems(test::kGoodDeployment, {{"rate", "15"}}),
      ElementsAre("deployment.yaml:1:1: --set rate: unknown setting; this file has no settings"));
}

TEST_F(DeploymentFile, PathsAreRelativeToTheFileAndThoseOfSettingsToTheWorkingDirectory) {
  std::filesystem::create_directory(folder() / "sub");
  write("sub/rig.yaml", test::kGoodRig);
  std::string text = "settings: {where: sub}\n" + test::kGoodDeployment.substr(1);
  text.replace(text.find("rig: rig.yaml"), 13, "rig: \"${where}/rig.yaml\"");
  EXPECT_EQ(load(text).rig.name, "two");
  EXPECT_EQ(load(text, {{"where", (folder() / "sub").string()}}).rig.name, "two");
  const std::filesystem::path from_here = std::filesystem::relative(folder() / "sub");
  EXPECT_EQ(load(text, {{"where", from_here.string()}}).rig.name, "two");
  EXPECT_THAT(problems(text, {{"where", "nowhere"}}),
              ElementsAre("deployment.yaml:3:6: rig " +
                          (std::filesystem::current_path() / "nowhere/rig.yaml").string() +
                          ": there is no such file"));
}

TEST_F(DeploymentFile, EmptyRequiredSettingIsReportedOnce) {
  const std::string text = "settings:\n  data: \"\"\n" + with_nodes(R"(  - name: c
    program: capture_node
    sources:
      left: {video: "${data}/l.avi", background: "${data}/lb.avi"}
      right: {video: "${data}/r.avi", background: "${data}/rb.avi"}
)");
  EXPECT_THAT(problems(text),
              ElementsAre("deployment.yaml:2:9: data is not set: pass --set data=FOLDER"));
  EXPECT_TRUE(test::contains(problems(text + "    host: ${dat}\n"),
                             "${dat}: unknown setting; known settings: data"));
}

TEST_F(DeploymentFile, ReportsProblemsOfAllFilesTogether) {
  write("rig.yaml", "name: r\nvolume_m: {min: [0, 0, 0], max: [1, 1, .nan]}\ncameras: []\n");
  write("scene.yaml", "name: s\nobjcts: []\n");
  EXPECT_THAT(
      problems("name: d\nrig: rig.yaml\nscene: scene.yaml\nframe_rate_hz: 0\nviewer: {path: "
               "[]}\nnodes: [{name: x, program: recon}]\n"),
      ElementsAre(
          "deployment.yaml:4:16: frame_rate_hz must be greater than 0 and at most 1000, is 0",
          "deployment.yaml:5:16: path must be a list of at least one, is a list of 0",
          "deployment.yaml:6:28: program must be one of capture_node, recon_node, sim_node, "
          "render_node; is \"recon\"",
          "rig.yaml:2:40: max[2] must be finite, is .nan",
          "rig.yaml:3:10: cameras must be a list of at least one, is a list of 0",
          "scene.yaml:2:1: unknown key objcts: did you mean objects?"));
}

// Reading a pipe would wait for its writer for ever.
TEST_F(DeploymentFile, PipesAreRefused) {
  ASSERT_EQ(mkfifo((folder() / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(problems_of([&] { load_deployment(folder() / "pipe"); }),
            std::vector<std::string>{"pipe:0:0: is a pipe, not a file"});
  const std::string is_pipe = (folder() / "pipe").string() + ": is a pipe, not a file";
  const std::string pose = "[{eye_m: [0, -1, 0.5], target_m: [0, 0, 0.2]}]";
  EXPECT_THAT(
      problems("name: d\nrig: pipe\nscene: pipe\nviewer: {path: " + pose +
               "}\nnodes: [{name: s, program: sim_node}]\n"),
      ElementsAre("deployment.yaml:2:6: rig " + is_pipe, "deployment.yaml:3:8: scene " + is_pipe));
  EXPECT_THAT(problems("name: d\nrig: rig.yaml\nscene: scene.yaml\nviewer: {file: pipe}\n"
                       "nodes: [{name: s, program: sim_node}]\n"),
              ElementsAre("pipe:0:0: is a pipe, not a file"));
  EXPECT_TRUE(test::contains(
      problems(with_nodes("  - {name: c, program: capture_node, sources: {left: {video: pipe, "
                          "background: pipe}, right: synthetic}}\n")),
      "video " + is_pipe));
}

TEST_F(DeploymentFile, MissingFilesAreReportedAtTheirReference) {
  EXPECT_EQ(problems_of([&] { load_deployment(folder() / "none.yaml"); }),
            std::vector<std::string>{"none.yaml:0:0: there is no such file"});
  const auto found = problems(
      "name: d\nrig: norig.yaml\nscene: .\nviewer: {path: [{eye_m: [0, -1, 0.5], target_m: [0, 0, "
      "0.2]}]}\nnodes: [{name: s, program: sim_node}]\n");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(test::contains(found, "deployment.yaml:2:6: rig " +
                                        (folder() / "norig.yaml").string() +
                                        ": there is no such file"));
  EXPECT_TRUE(test::contains(found, "deployment.yaml:3:8: scene "));
  EXPECT_TRUE(test::contains(found, ": is a directory, not a file"));
  EXPECT_THAT(problems("name: d\n"),
              ElementsAre("deployment.yaml:1:1: nodes is missing in the file",
                          "deployment.yaml:1:1: rig is missing in the file",
                          "deployment.yaml:1:1: scene is missing in the file",
                          "deployment.yaml:1:1: viewer is missing in the file"));
}

TEST_F(DeploymentFile, RejectsAnInvalidViewer) {
  std::string text = test::kGoodDeployment;
  text.replace(text.find("nodes:"), 0,
               "  horizontal_fov_deg: 180\n  render_size_px: [640]\n  recon_size_px: [0, 240]\n  "
               "near_m: 2\n  far_m: 1\n");
  EXPECT_THAT(
      problems(text),
      ElementsAre("deployment.yaml:5:3: near_m (2) must be less than far_m (1)",
                  "deployment.yaml:7:23: horizontal_fov_deg must be from 1 to 170, is 180",
                  "deployment.yaml:8:19: render_size_px must be a list of 2, is a list of 1",
                  "deployment.yaml:9:19: recon_size_px[0] must be from 1 to 16384, is 0"));
  text = test::kGoodDeployment;
  text.replace(text.find("- {t_s: 0"), 9, "- {t_s: 1");
  EXPECT_THAT(problems(text),
              ElementsAre("deployment.yaml:6:7: t_s of the first key must be 0, is 1"));
}

TEST_F(DeploymentFile, EveryNodeHasTheHullRule) {
  const std::string nodes =
      "  - {name: c, program: capture_node, sources: synthetic}\n"
      "  - {name: r, program: recon_node}\n  - {name: s, program: sim_node}\n";
  const auto rules = [&](const Deployment& d) {
    return std::vector<hull::HullRule>{d.hull_rule,
                                       std::get<CaptureConfig>(d.nodes[0].config).hull_rule,
                                       std::get<ReconConfig>(d.nodes[1].config).hull_rule,
                                       std::get<SimConfig>(d.nodes[2].config).hull_rule};
  };
  for (const hull::HullRule& rule : rules(load(with_nodes(nodes)))) {
    EXPECT_EQ(rule.limits, hull::Limits::all);
    EXPECT_EQ(rule.within_world_m.min(), Eigen::Vector3d(-0.5, -0.5, 0)) << "the rig's volume";
    EXPECT_EQ(rule.within_world_m.max(), Eigen::Vector3d(0.5, 0.5, 1));
  }
  for (const hull::HullRule& rule : rules(load(with_nodes(nodes) + "hull: {limits: all}\n")))
    EXPECT_EQ(rule.limits, hull::Limits::all);
  for (const auto& [keys, min_seen] : {std::pair("", 2), {", min_seen: 1", 1}})
    for (const hull::HullRule& rule :
         rules(load(with_nodes(nodes) + "hull: {limits: seen" + keys + "}\n"))) {
      EXPECT_EQ(rule.limits, hull::Limits::seen);
      EXPECT_EQ(rule.min_seen, min_seen);
    }
}

TEST_F(DeploymentFile, EveryNodeKnowsWhetherSilhouettesAreSubPixel) {
  const std::string nodes =
      "  - {name: c, program: capture_node, sources: synthetic}\n"
      "  - {name: r, program: recon_node}\n  - {name: s, program: sim_node}\n";
  for (const bool coverage : {false, true}) {
    const Deployment d =
        load(with_nodes(nodes) + (coverage ? "hull: {coverage: true}\n" : "hull: {}\n"));
    EXPECT_EQ(d.coverage, coverage);
    EXPECT_EQ(std::get<CaptureConfig>(d.nodes[0].config).coverage, coverage);
    EXPECT_EQ(std::get<ReconConfig>(d.nodes[1].config).coverage, coverage);
    EXPECT_EQ(std::get<SimConfig>(d.nodes[2].config).coverage, coverage);
  }
}

TEST_F(DeploymentFile, SubPixelSilhouettesNeedTheHullOfAllCamerasOnTheCpu) {
  EXPECT_THAT(problems(test::kGoodDeployment + "hull: {limits: seen, coverage: true}\n"),
              ElementsAre(testing::HasSubstr("coverage needs limits: all; remove one of the two")));
  for (const std::string backend : {"cpu", "auto", "gl", "sweep"}) {
    const auto found =
        problems(with_nodes("  - {name: r, program: recon_node, backend: " + backend + "}\n") +
                 "hull: {coverage: true}\n");
    if (backend == "cpu" || backend == "auto")
      EXPECT_THAT(found, ElementsAre()) << backend;
    else
      EXPECT_THAT(found,
                  ElementsAre(testing::HasSubstr("r: hull coverage needs backend: cpu (or auto)")))
          << backend;
  }
}

// The rig has the cameras left and right.
TEST_F(DeploymentFile, LostCamerasAreDispensableIfTheirNodeGoesOn) {
  const auto dispensable = [&](const std::string& of_left, const std::string& of_right,
                               const std::string& hull = "") {
    return dispensable_cameras(load(
        with_nodes("  - {name: a, program: capture_node, sources: {left: synthetic}" + of_left +
                   "}\n  - {name: b, program: capture_node, sources: {right: synthetic}" +
                   of_right + "}\n") +
        hull));
  };
  using Names = std::set<std::string>;
  EXPECT_EQ(dispensable("", ", lost_camera: wait"), Names{});
  EXPECT_EQ(dispensable("", ", lost_camera: continue"), Names{"right"});
  EXPECT_EQ(
      dispensable(", lost_camera: continue", ", lost_camera: continue", "hull: {limits: seen}\n"),
      (Names{"left", "right"}));
}

// The rig has two cameras that give shape.
TEST_F(DeploymentFile, RejectsHullRulesThatTheRigCannotFulfil) {
  const auto of_hull = [&](const std::string& hull) {
    return problems(test::kGoodDeployment + "hull: " + hull + "\n");
  };
  EXPECT_THAT(of_hull("{limits: seen, min_seen: 3}"),
              ElementsAre("deployment.yaml:13:32: min_seen must be from 1 to 2, is 3"));
  EXPECT_THAT(of_hull("{limits: seen, min_seen: 0}"),
              ElementsAre("deployment.yaml:13:32: min_seen must be from 1 to 2, is 0"));
  EXPECT_THAT(of_hull("{limits: some}"),
              ElementsAre("deployment.yaml:13:16: limits must be one of all, seen; is \"some\""));
  EXPECT_THAT(of_hull("{min_seen: 2}"),
              ElementsAre("deployment.yaml:13:18: min_seen has an effect only with limits: seen; "
                          "remove it"));
  EXPECT_THAT(of_hull("{limits: seen, cameras: 2}"),
              ElementsAre(testing::HasSubstr("deployment.yaml:13:")));
  EXPECT_THAT(problems(test::kGoodDeployment + "without_cameras: [left]\nhull: {limits: seen}\n"),
              ElementsAre("deployment.yaml:14:16: min_seen is 2 by default, but the rig has 1 "
                          "camera that gives shape: set min_seen: 1"));
  EXPECT_TRUE(problems(test::kGoodDeployment +
                       "without_cameras: [left]\nhull: {limits: seen, min_seen: 1}\n")
                  .empty());
}

TEST_F(DeploymentFile, ErrorTextListsOneProblemPerLine) {
  try {
    load("name: Bad\n");
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find((folder() / "deployment.yaml").string() +
                        ":1:7: name must consist of a-z, 0-9 and _, is \"Bad\""),
              std::string::npos)
        << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n') + 1,
              std::ptrdiff_t(error.problems().size()));
  }
}

}  // namespace
}  // namespace fivepipe::config
