#include "common/config/deployment.h"

#include <algorithm>
#include <numbers>

#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class DeploymentFile : public test::SceneFiles {
 protected:
  DeploymentFile() {
    write("rig.yaml", test::kGoodRig);
    write("scene.yaml", test::kGoodScene);
  }
  Deployment load(const std::string& text,
                  const std::map<std::string, std::string>& settings = {}) {
    return load_deployment(write("deployment.yaml", text), settings);
  }
  std::vector<std::string> problems(const std::string& text,
                                    const std::map<std::string, std::string>& settings = {}) {
    return problems_of([&] { load(text, settings); });
  }
  // A deployment with these nodes; the first is in line 7.
  static std::string with_nodes(const std::string& nodes) {
    return "name: small\nrig: rig.yaml\nscene: scene.yaml\nviewer:\n  path: [{eye_m: [0, -1, 0.5], "
           "target_m: [0, 0, 0.2]}]\nnodes:\n" +
           nodes;
  }
};

TEST_F(DeploymentFile, TooManyHistoryCellsIsAProblem) {
  write("scene.yaml", test::kGoodScene + "history: {cell_m: 0.0005}\n");
  EXPECT_THAT(problems(with_nodes("  - {name: s, program: sim_node}\n")),
              ElementsAre(testing::AllOf(
                  testing::HasSubstr(
                      "deployment.yaml:3:8: history of the scene divides the rig's volume_m into"),
                  testing::HasSubstr("a larger cell_m in its history, or a smaller volume_m"))));
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

TEST_F(DeploymentFile, ReadsWhatIsWritten) {
  write("film_0003.png", "not looked into");
  write("plate.png", "not looked into");
  const Deployment d = load(R"(
name: full
rig: rig.yaml
scene: scene.yaml
domain: 7
network_profile: lab
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
nodes:
  - name: files
    program: capture_node
    host: far_away
    cores: [2, 3]
    sources:
      left: {v4l2: /dev/v4l/by-id/some-camera, background_frames: 12}
    loop: false
  - name: film
    program: capture_node
    sources:
      right: {video: film_%04d.png, background: plate.png, first_frame: 3}
    segmentation: {threshold_sigmas: 5, threshold_floor_levels: 10, shadow_darkest: 1, opening_px: 0, closing_px: 2}
    synthetic: {seed: 9, period_s: 2, noise_sigma_levels: 0, cast_shadow: false}
    max_frames_in_flight: 0
    precomputed_frames: 60
  - name: a
    program: recon_node
    backend: sweep
    sweep_planes: 128
    tile_columns: 2
    tile_rows: 1
    share: 1
    shares: 2
  - name: b
    program: recon_node
    tile_columns: 2
    tile_rows: 1
    share: 0
    shares: 2
  - name: s
    program: sim_node
    collision: paper
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
)");
  EXPECT_EQ(d.domain, 7u);
  EXPECT_EQ(d.network_profile, "lab");
  EXPECT_EQ(d.frame_rate_hz, 25);
  EXPECT_EQ(d.viewer.name, "anna");
  ASSERT_EQ(d.viewer.path.size(), 2u);
  EXPECT_EQ(d.viewer.path[1].t_s, 2.5);
  EXPECT_NEAR(d.viewer.horizontal_fov_rad, std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(d.viewer.render_height_px, 600);
  EXPECT_EQ(d.viewer.recon_width_px, 400);
  EXPECT_EQ(d.viewer.far_m, 4);

  ASSERT_EQ(d.nodes.size(), 6u);
  EXPECT_EQ(d.nodes[0].host, "far_away");
  EXPECT_EQ(d.nodes[0].cores, (std::vector<int>{2, 3}));
  const auto& files = std::get<CaptureConfig>(d.nodes[0].config);
  EXPECT_FALSE(files.loop);
  EXPECT_EQ(std::get<V4l2Source>(files.sources.at("left")).device, "/dev/v4l/by-id/some-camera");
  EXPECT_EQ(std::get<V4l2Source>(files.sources.at("left")).background_frames, 12);
  const auto& film = std::get<CaptureConfig>(d.nodes[1].config);
  EXPECT_EQ(std::get<VideoSource>(film.sources.at("right")).file,
            (folder() / "film_%04d.png").string());
  EXPECT_EQ(std::get<VideoSource>(film.sources.at("right")).background,
            (folder() / "plate.png").string());
  EXPECT_EQ(std::get<VideoSource>(film.sources.at("right")).first_frame, 3);
  EXPECT_EQ(film.segmentation.threshold_sigmas, 5);
  EXPECT_EQ(film.segmentation.closing_px, 2);
  EXPECT_EQ(film.synthetic.seed, 9u);
  EXPECT_FALSE(film.synthetic.cast_shadow);
  EXPECT_EQ(film.max_frames_in_flight, 0);
  EXPECT_EQ(film.precomputed_frames, 60);
  const auto& a = std::get<ReconConfig>(d.nodes[2].config);
  EXPECT_EQ(a.backend, HullBackend::sweep);
  EXPECT_EQ(a.sweep_planes, 128);
  EXPECT_EQ(a.tile_columns, 2);
  EXPECT_EQ(a.worker_index, 1);
  const auto& s = std::get<SimConfig>(d.nodes[4].config);
  EXPECT_EQ(s.collision, CollisionBackend::paper);
  EXPECT_EQ(s.eps_m, 0.001);
  EXPECT_EQ(s.spacing_m, 0.004);
  EXPECT_EQ(s.viewport_px, 20);
  EXPECT_EQ(s.step_s, 0.005);
  EXPECT_EQ(s.max_points, 8);
  const auto& r = std::get<RenderConfig>(d.nodes[5].config);
  EXPECT_TRUE(r.window);
  EXPECT_FALSE(r.video);
  EXPECT_EQ(r.still_frame, 10);

  EXPECT_EQ(program_of(d.nodes[0]), "capture_node");
  EXPECT_EQ(program_of(d.nodes[2]), "recon_node");
  EXPECT_EQ(program_of(d.nodes[4]), "sim_node");
  EXPECT_EQ(program_of(d.nodes[5]), "render_node");
  EXPECT_EQ(find_node(d, "s"), &d.nodes[4]);
  EXPECT_EQ(find_node(d, "x"), nullptr);
}

TEST_F(DeploymentFile, TheCollisionHasThreeBackends) {
  const auto backend = [&](const std::string& name) {
    return std::get<SimConfig>(
               load(with_nodes("  - {name: s, program: sim_node, collision: " + name + "}\n"))
                   .nodes[0]
                   .config)
        .collision;
  };
  EXPECT_EQ(backend("cpu"), CollisionBackend::cpu);
  EXPECT_EQ(backend("gl"), CollisionBackend::gl);
  EXPECT_EQ(backend("paper"), CollisionBackend::paper);
}

TEST_F(DeploymentFile, HeadPathComesFromAFile) {
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
      ElementsAre(
          "deployment.yaml:1:11: --set rat: there is no such setting; known settings: place rate"));
  EXPECT_THAT(
      problems(test::kGoodDeployment, {{"rate", "15"}}),
      ElementsAre(
          "deployment.yaml:1:1: --set rate: there is no such setting; this file has no settings"));
}

TEST_F(DeploymentFile, PathsAreRelativeToTheFileOrForSetToTheWorkingDirectory) {
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
                             "${dat}: there is no such setting; known settings: data"));
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

TEST_F(DeploymentFile, EveryCameraHasOneSource) {
  EXPECT_THAT(
      problems(with_nodes("  - {name: c, program: capture_node, sources: {left: synthetic}}\n")),
      ElementsAre(
          "deployment.yaml:7:3: camera right of rig two has no source in any capture node"));
  EXPECT_THAT(
      problems(with_nodes("  - {name: c, program: capture_node, sources: {left: synthetic, rihgt: "
                          "synthetic, right: synthetic}}\n"
                          "  - {name: d, program: capture_node, sources: {left: synthetic}}\n")),
      ElementsAre("deployment.yaml:7:72: rig two has no camera rihgt: did you mean right?",
                  "deployment.yaml:8:54: camera left is read by c already"));
  EXPECT_TRUE(problems(with_nodes("  - {name: r, program: recon_node}\n")).empty())
      << "without a capture node maps come from a replay";
}

TEST_F(DeploymentFile, SyntheticCamerasSeeOneWorld) {
  EXPECT_THAT(
      problems(with_nodes(
          "  - {name: c, program: capture_node, sources: {left: synthetic}, synthetic: {seed: 1}}\n"
          "  - {name: d, program: capture_node, sources: {right: synthetic}, synthetic: {seed: "
          "2}}\n")),
      ElementsAre("deployment.yaml:8:5: d: synthetic (seed, period_s, cast_shadow) differs from "
                  "that of another capture node"));
}

TEST_F(DeploymentFile, SharesCoverTheViewOnce) {
  const auto recon = [](const std::string& name, const std::string& config) {
    return "  - {name: " + name + ", program: recon_node, " + config + "}\n";
  };
  EXPECT_TRUE(
      problems(with_nodes(recon("a", "share: 1, shares: 2") + recon("b", "share: 0, shares: 2")))
          .empty());
  EXPECT_THAT(
      problems(with_nodes(recon("a", "share: 1, shares: 2") + recon("b", "share: 1, shares: 2"))),
      ElementsAre("deployment.yaml:7:5: no reconstruction node has share 0 of 2",
                  "deployment.yaml:8:43: share 1 is that of a already"));
  EXPECT_THAT(
      problems(with_nodes(recon("a", "share: 0, shares: 2") + recon("b", "share: 1, shares: 3"))),
      ElementsAre("deployment.yaml:8:5: b: tile_columns, tile_rows, shares, split and balance must "
                  "be the same in all reconstruction nodes"));
  EXPECT_THAT(
      problems(with_nodes(recon("a", "share: 2, shares: 2"))),
      ElementsAre("deployment.yaml:7:43: share must be less than shares: they count from 0 to 1"));
  EXPECT_TRUE(test::contains(
      problems(with_nodes(recon("a", "tile_columns: 1, tile_rows: 1, share: 0, shares: 2") +
                          recon("b", "tile_columns: 1, tile_rows: 1, share: 1, shares: 2"))),
      "some shares would own no tile"));
}

TEST_F(DeploymentFile, NamesAreUniqueAndThereIsOneSimulationAndOneRenderer) {
  EXPECT_THAT(
      problems(
          with_nodes("  - {name: s, program: sim_node}\n  - {name: s, program: sim_node}\n  - "
                     "{name: r, program: render_node}\n  - {name: q, program: render_node}\n")),
      ElementsAre(
          "deployment.yaml:8:5: a second sim_node, the first is in line 7: at most one is allowed",
          "deployment.yaml:8:12: two nodes are called s, the first in line 7",
          "deployment.yaml:10:5: a second render_node, the first is in line 9: at most one is "
          "allowed"));
}

TEST_F(DeploymentFile, EveryProblemOfNodesIsReportedWithItsPlace) {
  EXPECT_THAT(
      problems(with_nodes(R"(  - name: c
    program: capture_node
    cores: [0, -1, 0]
    sources:
      left: {video: absent.avi}
      right: {v4l2: 0, background_frames: 0}
    segmentation: {threshold: 5, shadow_darkest: 0}
    synthetic: {period_ms: 4000}
  - name: s
    program: sim_node
    viewport_px: 500
    step_s: 1
    share: 1
  - host: here
)")),
      ElementsAre(
          "deployment.yaml:9:12: cores names one core twice",
          "deployment.yaml:9:16: cores[1] must be from 0 to 1023, is -1",
          "deployment.yaml:11:13: background is missing in left",
          "deployment.yaml:11:21: video " + (folder() / "absent.avi").string() +
              ": there is no such file",
          "deployment.yaml:12:43: background_frames must be from 1 to 10000, is 0",
          "deployment.yaml:13:20: unknown key threshold: threshold_sigmas is expected",
          "deployment.yaml:13:50: shadow_darkest must be greater than 0 and at most 1, is 0",
          "deployment.yaml:14:17: unknown key period_ms: period_s is expected",
          "deployment.yaml:17:18: viewport_px must not exceed window_px (400)",
          "deployment.yaml:18:13: step_s must be from 0.0001 to 0.1, is 1",
          "deployment.yaml:19:5: unknown key share; known keys: name host cores program collision "
          "threads eps_m spacing_m viewport_px window_px step_s max_points",
          "deployment.yaml:20:5: program is missing: capture_node, recon_node, sim_node or "
          "render_node",
          "deployment.yaml:20:5: name is missing in nodes[2]"));
}

TEST_F(DeploymentFile, ViewerIsChecked) {
  std::string text = test::kGoodDeployment;
  text.replace(text.find("nodes:"), 0,
               "  horizontal_fov_deg: 180\n  render_size_px: [640]\n  recon_size_px: [0, 240]\n  "
               "near_m: 2\n  far_m: 1\n");
  EXPECT_THAT(
      problems(text),
      ElementsAre("deployment.yaml:5:3: near_m must be less than far_m",
                  "deployment.yaml:7:23: horizontal_fov_deg must be from 1 to 170, is 180",
                  "deployment.yaml:8:19: render_size_px must be a list of 2, is a list of 1",
                  "deployment.yaml:9:19: recon_size_px[0] must be from 1 to 16384, is 0"));
  text = test::kGoodDeployment;
  text.replace(text.find("- {t_s: 0"), 9, "- {t_s: 1");
  EXPECT_THAT(problems(text), ElementsAre("deployment.yaml:6:7: the first key's t_s must be 0"));
}

TEST_F(DeploymentFile, IgnoresFilesOfOtherHosts) {
  const std::string sources =
      "sources: {left: {video: /there/l.avi, background: /there/b.avi}, right: synthetic}";
  EXPECT_EQ(problems(with_nodes("  - {name: c, program: capture_node, " + sources + "}\n")).size(),
            2u);
  EXPECT_TRUE(problems(with_nodes("  - {name: c, program: capture_node, host: another_machine, " +
                                  sources + "}\n"))
                  .empty());
}

TEST_F(DeploymentFile, WhatListsOneProblemPerLine) {
  try {
    load("name: Bad\n");
    FAIL() << "no problem found";
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
