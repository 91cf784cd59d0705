// The nodes of a deployment file: their keys, and the checks across nodes.
#include "tests/support/deployment_files.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;
using DeploymentFile = test::DeploymentFile;

TEST_F(DeploymentFile, ReadsEachCollisionBackend) {
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

TEST_F(DeploymentFile, EveryCameraHasOneSource) {
  EXPECT_THAT(
      problems(with_nodes("  - {name: c, program: capture_node, sources: {left: synthetic}}\n")),
      ElementsAre("deployment.yaml:7:3: camera right of rig two has no source: add it to the "
                  "sources of a capture node"));
  EXPECT_THAT(problems(with_nodes("  - {name: c, program: capture_node, sources: {left: synthetic, "
                                  "rihgt: synthetic, right: synthetic}}\n  - {name: d, program: "
                                  "capture_node, sources: {left: synthetic}}\n")),
              ElementsAre("deployment.yaml:7:72: rig two has no camera rihgt: did you mean right?",
                          "deployment.yaml:8:54: camera left is already read by node c"));
  EXPECT_TRUE(problems(with_nodes("  - {name: r, program: recon_node}\n")).empty())
      << "without a capture node, the maps come from a replay";
}

// The ways to find objects in a file.
TEST_F(DeploymentFile, ACameraFindsItsObjectsInOneWay) {
  write("a.png", "any content");
  const auto nodes = [](const std::string& key) {
    return with_nodes(
        "  - {name: c, program: capture_node, sources: {right: synthetic, left: "
        "{video: a.png, first_frame: 2, " +
        key + "}}}\n");
  };
  const auto key_of = [&](const std::string& text) {
    const Deployment deployment = load(nodes(text));
    return std::get<VideoSource>(
               std::get<CaptureConfig>(deployment.nodes[0].config).sources.at("left"))
        .key;
  };
  write("m3.png", "any content");
  EXPECT_EQ(std::get<MatteFile>(key_of("matte: m%d.png")).file, (folder() / "m%d.png").string());
  EXPECT_TRUE(std::holds_alternative<AlphaChannel>(key_of("alpha: true")));
  EXPECT_EQ(std::get<LearnedBackground>(key_of("background: a.png")).file,
            (folder() / "a.png").string());
  const auto screen = std::get<ChromaKey>(
      key_of("chroma_key: {rgb: [0.1, 0.2, 0.9], max_angle_deg: 20, min_chroma: 0.5}"));
  EXPECT_EQ(screen.rgb, (std::array{0.1, 0.2, 0.9}));
  EXPECT_EQ(screen.max_angle_deg, 20);
  EXPECT_EQ(screen.min_chroma, 0.5);
  const ChromaKey defaults = std::get<ChromaKey>(key_of("chroma_key: {}"));
  EXPECT_EQ(defaults.rgb, (std::array{0.0, 1.0, 0.0}));
  EXPECT_EQ(defaults.max_angle_deg, 30);
  EXPECT_EQ(defaults.min_chroma, 0.3);
  using ::testing::HasSubstr;
  EXPECT_THAT(
      problems(nodes("alpha: false")),
      ElementsAre(testing::HasSubstr("set one of background, matte, alpha and chroma_key")));
  EXPECT_THAT(problems(nodes("matte: x%d.png")),
              ElementsAre(testing::HasSubstr("x%d.png: no picture has such a name")));
  EXPECT_THAT(
      problems(nodes("matte: x%s.png")),
      ElementsAre(testing::HasSubstr("x%s.png: write %d where the names of the pictures have their "
                                     "number")));
  EXPECT_THAT(problems(nodes("matte: lost/x%d.png")),
              ElementsAre(testing::HasSubstr("lost: No such file")));
  for (const char* name : {"y7.png", "y007.png"}) std::ofstream(folder() / name) << "";
  EXPECT_THAT(problems(nodes("matte: y%d.png")),
              ElementsAre(testing::HasSubstr("two pictures have number 7: y007.png and y7.png")));
  EXPECT_THAT(
      problems(nodes("matte: a.png")),
      ElementsAre(testing::HasSubstr("matte must be a video or a sequence such as mask_%04d.png")));
  EXPECT_TRUE(problems(nodes("background: a.png, alpha: false")).empty());
  for (const char* unusable : {"matte: a.mp4", "alpha: true"})
    EXPECT_THAT(problems(with_nodes("  - {name: c, program: capture_node, sources: {right: "
                                    "synthetic, left: {v4l2: 0, " +
                                    std::string(unusable) + "}}}\n")),
                ElementsAre(testing::HasSubstr("unknown key")))
        << unusable;
  for (const char* key : {"chroma_key: {}", "background: a.png"})
    EXPECT_THAT(
        problems(with_nodes("  - {name: c, program: capture_node, sources: {right: "
                            "synthetic, left: {v4l2: 0, background_frames: 9, " +
                            std::string(key) + "}}}\n")),
        ElementsAre(testing::HasSubstr("background_frames is only for a camera that learns")))
        << key;
  EXPECT_THAT(problems(nodes("background: a.png, alpha: true")),
              ElementsAre(testing::HasSubstr(
                  "background and alpha are both set: a camera finds its objects in "
                  "one way")));
  EXPECT_THAT(problems(nodes("chroma_key: {rgb: [0.5, 0.6, 0.5]}")),
              ElementsAre(testing::HasSubstr("the colour [0.5, 0.6, 0.5] is too grey")));
  EXPECT_THAT(problems(nodes("chroma_key: {max_angle_deg: 0, min_chroma: 0}")),
              ElementsAre(testing::HasSubstr("max_angle_deg must be from 1 to 90, is 0"),
                          HasSubstr("min_chroma must be greater than 0 and at most 1, is 0")));
  const Deployment camera = load(
      with_nodes("  - {name: c, program: capture_node, sources: {right: synthetic, left: {v4l2: 0, "
                 "chroma_key: {}}}}\n"));
  EXPECT_TRUE(std::holds_alternative<ChromaKey>(
      std::get<V4l2Source>(std::get<CaptureConfig>(camera.nodes[0].config).sources.at("left"))
          .key));
}

TEST_F(DeploymentFile, SegmentationHasAVolumeAndRegions) {
  const auto nodes = [](const std::string& segmentation) {
    return with_nodes("  - name: c\n    program: capture_node\n    sources: synthetic\n" +
                      ("    segmentation: {" + segmentation + "}\n"));
  };
  const Deployment deployment = load(nodes("volume_m: rig"));
  const auto& found = std::get<CaptureConfig>(deployment.nodes[0].config).segmentation;
  ASSERT_TRUE(found.volume_m);
  EXPECT_EQ(found.volume_m->min(), deployment.rig.volume_m.min());
  EXPECT_EQ(found.volume_m->max(), deployment.rig.volume_m.max());
  EXPECT_THAT(problems(nodes("volume_m: all")),
              ElementsAre(::testing::HasSubstr("volume_m must be one of rig; is \"all\"")));
  EXPECT_THAT(problems(nodes("volume_m: {min: [0, 0, 0], max: [1, -1, 1]}")),
              ElementsAre(::testing::HasSubstr("max must be greater than min (0) in y, is -1")));
  EXPECT_THAT(problems(nodes("volume_m: {min: [0, 90, 0], max: [1, 91, 1]}")),
              ElementsAre(::testing::HasSubstr("camera left sees no part of this volume_m"),
                          ::testing::HasSubstr("camera right sees no part of this volume_m")));
  EXPECT_THAT(problems(nodes("regions: {middle: rig.yaml, left: absent.png}")),
              ElementsAre("deployment.yaml:10:38: rig two has no camera middle",
                          "deployment.yaml:10:54: left " + (folder() / "absent.png").string() +
                              ": there is no such file"));
  EXPECT_THAT(problems(nodes("threshold_ceiling_levels: 7.5")),
              ElementsAre(::testing::HasSubstr(
                  "threshold_ceiling_levels must be at least threshold_floor_levels (8), is 7.5")));
  // A floor alone raises the ceiling with it.
  const Deployment high = load(nodes("threshold_floor_levels: 20"));
  EXPECT_EQ(std::get<CaptureConfig>(high.nodes[0].config).segmentation.threshold_ceiling_levels,
            20);
}

TEST_F(DeploymentFile, HandLengthAndToolNeedAnActorThatHasThem) {
  const auto nodes = [&](const std::string& keys) {
    return with_nodes("  - {name: c, program: capture_node, sources: synthetic, synthetic: {" +
                      keys + "}}\n");
  };
  const Deployment tongs = load(nodes("actor: pipe_task, tool: tongs, hand_length_m: 0.165"));
  const SyntheticWorld& world = std::get<CaptureConfig>(tongs.nodes[0].config).synthetic;
  EXPECT_EQ(world.actor, SyntheticActor::pipe_task);
  EXPECT_EQ(world.tool, SyntheticTool::tongs);
  EXPECT_EQ(world.hand_length_m, 0.165);
  EXPECT_TRUE(problems(nodes("actor: reaching_arm, hand_length_m: 0.21")).empty());
  EXPECT_TRUE(problems(nodes("actor: reaching_and_leaning, hand_length_m: 0.21")).empty());
  EXPECT_THAT(problems(nodes("hand_length_m: 0.2")),
              ElementsAre(testing::HasSubstr("hand_length_m has no effect on this actor")));
  EXPECT_THAT(problems(nodes("actor: reaching_arm, tool: tongs")),
              ElementsAre(testing::HasSubstr("tool has no effect without actor pipe_task")));
  EXPECT_THAT(problems(nodes("actor: pipe_task, hand_length_m: 0.3")),
              ElementsAre(testing::HasSubstr("hand_length_m")));
  EXPECT_THAT(problems(nodes("actor: pipe_task, tool: pliers")),
              ElementsAre(testing::HasSubstr("tool")));
}

TEST_F(DeploymentFile, SyntheticCamerasSeeOneWorld) {
  EXPECT_THAT(
      problems(with_nodes("  - {name: c, program: capture_node, sources: {left: synthetic}, "
                          "synthetic: {seed: 1}}\n  - {name: d, program: capture_node, sources: "
                          "{right: synthetic}, synthetic: {seed: 2}}\n")),
      ElementsAre("deployment.yaml:8:5: d: seed, period_s, cast_shadow, actor, hand_length_m and "
                  "tool of synthetic must be the same in all capture nodes"));
  for (const char* other : {"hand_length_m: 0.2", "tool: tongs"})
    EXPECT_EQ(
        problems(
            with_nodes(
                std::string("  - {name: c, program: capture_node, sources: {left: synthetic}, "
                            "synthetic: {actor: pipe_task}}\n  - {name: d, program: capture_node, "
                            "sources: {right: synthetic}, synthetic: {actor: pipe_task, ") +
                other + "}}\n"))
            .size(),
        1u)
        << other;
  EXPECT_EQ(problems(with_nodes(
                         "  - {name: c, program: capture_node, sources: {left: synthetic}}\n  - "
                         "{name: d, program: capture_node, sources: {right: synthetic}, synthetic: "
                         "{actor: parting_hands}}\n"))
                .size(),
            1u);
}

TEST_F(DeploymentFile, WorkersCoverTheViewOnce) {
  const auto recon = [](const std::string& name, const std::string& config) {
    return "  - {name: " + name + ", program: recon_node, " + config + "}\n";
  };
  EXPECT_TRUE(problems(with_nodes(recon("a", "worker: 1, workers: 2") +
                                  recon("b", "worker: 0, workers: 2")))
                  .empty());
  EXPECT_THAT(
      problems(
          with_nodes(recon("a", "worker: 1, workers: 2") + recon("b", "worker: 1, workers: 2"))),
      ElementsAre("deployment.yaml:7:5: workers is 2, but no reconstruction node has worker 0",
                  "deployment.yaml:8:44: worker 1 is already node a"));
  EXPECT_THAT(problems(with_nodes(recon("a", "worker: 0, workers: 2") +
                                  recon("b", "worker: 1, workers: 3"))),
              ElementsAre("deployment.yaml:8:5: b: tile_columns, tile_rows, workers, split and "
                          "balance must be the same in all reconstruction nodes"));
  EXPECT_THAT(problems(with_nodes(recon("a", "worker: 2, workers: 2"))),
              ElementsAre("deployment.yaml:7:44: worker must be less than workers (2), is 2"));
  EXPECT_TRUE(test::contains(
      problems(with_nodes(recon("a", "tile_columns: 1, tile_rows: 1, worker: 0, workers: 2") +
                          recon("b", "tile_columns: 1, tile_rows: 1, worker: 1, workers: 2"))),
      "workers must be at most tile_columns + tile_rows - 1 = 1, is 2: more workers would own no "
      "tile"));
}

TEST_F(DeploymentFile, NamesAreUniqueWithAtMostOneSimulationAndOneRenderer) {
  EXPECT_THAT(
      problems(
          with_nodes("  - {name: s, program: sim_node}\n  - {name: s, program: sim_node}\n  - "
                     "{name: r, program: render_node}\n  - {name: q, program: render_node}\n")),
      ElementsAre(
          "deployment.yaml:8:5: a deployment has at most one sim_node, the first is in line 7",
          "deployment.yaml:8:12: node name s is already used in line 7",
          "deployment.yaml:10:5: a deployment has at most one render_node, the first is in line "
          "9; a further one needs `viewer`: it draws for a spectator"));
}

// A render_node of its own draws for each spectator.
TEST_F(DeploymentFile, SpectatorsAreFurtherRenderers) {
  const std::string spectator =
      "program: render_node, viewer: {path: [{eye_m: [0, -1, 0.5], target_m: [0, 0, 0.2]}], "
      "near_m: 0.2";
  const Deployment deployment =
      load(with_nodes("  - {name: r, program: render_node}\n  - {name: a, " + spectator +
                      ", recon_size_px: [80, 60]}}\n  - {name: b, " + spectator + "}}\n"));
  EXPECT_TRUE(draws_for_viewer(deployment.nodes[0]));
  EXPECT_EQ(spectator_of(deployment.nodes[0]), nullptr);
  for (const std::size_t node : {1u, 2u}) {
    EXPECT_FALSE(draws_for_viewer(deployment.nodes[node]));
    ASSERT_NE(spectator_of(deployment.nodes[node]), nullptr);
    EXPECT_EQ(spectator_of(deployment.nodes[node])->name, node == 1 ? "a" : "b");
    EXPECT_EQ(spectator_of(deployment.nodes[node])->near_m, 0.2);
  }
  EXPECT_EQ(spectator_of(deployment.nodes[1])->recon_width_px, 80);
  EXPECT_FALSE(draws_for_viewer(load(with_nodes("  - {name: s, program: sim_node}\n")).nodes[0]));
  EXPECT_THAT(problems(with_nodes("  - {name: viewer, " + spectator + "}}\n")),
              ElementsAre("deployment.yaml:7:12: node viewer draws for a spectator, so that its "
                          "name cannot be that of the viewer"));
  EXPECT_THAT(problems(with_nodes("  - {name: a, " + spectator + ", name: b}}\n")).size(), 1);
  EXPECT_THAT(problems(with_nodes("  - {name: a, " + spectator +
                                  ", recon_size_px: [7, 60]}}\n  - {name: x, program: "
                                  "recon_node, tile_columns: 8, tile_rows: 1}\n")),
              ElementsAre("deployment.yaml:8:5: more tiles (8 x 1) than pixels (7 x 60): reduce "
                          "tile_columns or tile_rows, or increase recon_size_px of a"));
  // One view is within the limit, two are not.
  EXPECT_THAT(problems(with_nodes("  - {name: a, " + spectator +
                                  "}}\n  - {name: x, program: recon_node, tile_columns: 64, "
                                  "tile_rows: 64}\n")),
              ElementsAre("deployment.yaml:8:5: 64 x 64 tiles in each of 2 views are 8192, a frame "
                          "may have 4096: reduce tile_columns or tile_rows"));
}

TEST_F(DeploymentFile, ReportsEveryProblemOfNodesWithItsLocation) {
  EXPECT_THAT(
      problems(with_nodes(R"(  - name: c
    program: capture_node
    cores: [0, -1, 0]
    sources:
      left: {video: absent.avi}
      right: {v4l2: 0, background_frames: 0}
    segmentation: {threshold: 5, shadow_min_brightness: 0}
    synthetic: {period_ms: 4000}
    max_frames_in_flight: 65
  - name: s
    program: sim_node
    viewport_px: 500
    step_s: 1
    worker: 1
  - host: here
)")),
      ElementsAre(
          "deployment.yaml:9:12: cores contains core 0 twice",
          "deployment.yaml:9:16: cores[1] must be from 0 to 1023, is -1",
          "deployment.yaml:11:13: set one of background, matte, alpha and chroma_key: how to find "
          "the "
          "objects in the images",
          "deployment.yaml:11:21: video " + (folder() / "absent.avi").string() +
              ": there is no such file",
          "deployment.yaml:12:43: background_frames must be from 1 to 128, is 0",
          "deployment.yaml:13:20: unknown key threshold: use threshold_sigmas",
          "deployment.yaml:13:57: shadow_min_brightness must be greater than 0 and at most 1, is 0",
          "deployment.yaml:14:17: unknown key period_ms: use period_s",
          "deployment.yaml:15:27: max_frames_in_flight must be from 0 to 64, is 65",
          "deployment.yaml:18:18: viewport_px must be at most window_px (400), is 500",
          "deployment.yaml:19:13: step_s must be from 0.0001 to 0.1, is 1",
          "deployment.yaml:20:5: unknown key worker; known keys: name, host, cores, program, "
          "collision, threads, eps_m, spacing_m, viewport_px, window_px, step_s, max_points",
          "deployment.yaml:21:5: program is missing: set capture_node, recon_node, sim_node or "
          "render_node",
          "deployment.yaml:21:5: name is missing in nodes[2]"));
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

}  // namespace
}  // namespace fivepipe::config
