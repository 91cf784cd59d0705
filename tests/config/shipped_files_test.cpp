// Checks that the shipped rigs, scenes and deployments match their comments.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>

#include "common/config/deployment.h"
#include "common/geometry/closed_mesh.h"
#include "tests/support/capture/footage.h"
#include "tests/support/scene_files.h"

namespace fivepipe::config {
namespace {

using Eigen::Vector3d;

const std::filesystem::path kSource = FIVEPIPE_SOURCE_DIR;
const std::filesystem::path kRecording = test::seated4cam_folder();

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder,
                                            const std::string& name_ends_in) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().string().ends_with(name_ends_in))
      files.push_back(entry.path());
  return files;
}

// Returns the fraction of a grid of points of the box that the camera sees.
double visible_fraction(const geometry::Camera& camera, const Eigen::AlignedBox3d& box_m) {
  constexpr int kSteps = 10;
  int seen = 0;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j)
      for (int k = 0; k <= kSteps; ++k) {
        const auto uv_px = geometry::project(
            camera, box_m.min() + box_m.sizes().cwiseProduct(Vector3d(i, j, k)) / kSteps);
        if (uv_px && uv_px->x() >= -0.5 && uv_px->y() >= -0.5 &&
            uv_px->x() < camera.pinhole.width_px - 0.5 &&
            uv_px->y() < camera.pinhole.height_px - 0.5)
          ++seen;
      }
  return double(seen) / ((kSteps + 1) * (kSteps + 1) * (kSteps + 1));
}

const SceneObject& object_called(const Scene& scene, const std::string& name) {
  for (const SceneObject& object : scene.objects)
    if (object.name == name) return object;
  throw std::runtime_error("no object " + name);
}

Eigen::AlignedBox3d world_bounds_m(const SceneObject& object) {
  Eigen::AlignedBox3d box_m;
  for (const Vector3d& v : mesh_of(object).vertices_m) box_m.extend(object.world_from_object * v);
  return box_m;
}

TEST(ShippedRigs, LoadAndSeeTheirWholeVolume) {
  std::vector<std::filesystem::path> rigs = files_in(kSource / "scenes" / "rigs", ".yaml");
  ASSERT_GE(rigs.size(), 3u);
  for (const auto& file : rigs) {
    const Rig rig = test::load_rig(file);
    EXPECT_EQ(rig.name, file.stem().string());
    for (const std::size_t i : shape_cameras(rig))
      EXPECT_GT(visible_fraction(published_camera(rig.cameras[i]), rig.volume_m), 0.99)
          << file << ' ' << rig.cameras[i].name;
  }
}

TEST(ShippedRigs, MatchTheirNames) {
  const Rig paper = test::load_rig(kSource / "scenes/rigs/paper.yaml"),
            table4 = test::load_rig(kSource / "scenes/rigs/table4.yaml");
  EXPECT_EQ(shape_cameras(paper).size(), 3u);
  EXPECT_EQ(paper.cameras.back().mount, Mount::viewer);
  EXPECT_TRUE(paper.cameras.back().gives_colour);
  EXPECT_EQ(shape_cameras(table4).size(), 4u);
  for (const auto& [name, cameras] : {std::pair{"ring16", 16u}, {"table3", 3u}, {"table8", 8u}})
    EXPECT_EQ(shape_cameras(test::load_rig(kSource / "scenes/rigs" / (std::string(name) + ".yaml")))
                  .size(),
              cameras)
        << name;
  const geometry::Camera table_height = published_camera(table4.cameras[3]);
  EXPECT_NEAR(geometry::camera_center_world_m(table_height).z(), 0.03, 1e-12);
  EXPECT_NEAR(table_height.camera_from_world.linear()(2, 2), 0, 1e-12)
      << "the camera does not look horizontally";
}

TEST(ShippedScenes, Load) {
  const auto scenes = files_in(kSource / "scenes", "scene.yaml");
  ASSERT_GE(scenes.size(), 2u);
  for (const auto& file : scenes)
    EXPECT_EQ(test::load_scene(file).name, file.parent_path().filename().string());
}

TEST(DemoScene, HasThePapersCurtainAboveATableAtZeroHeight) {
  const Scene demo = test::load_scene(kSource / "scenes/demo/scene.yaml");
  EXPECT_EQ(mesh_of(object_called(demo, "curtain")).triangles.size(), 720u);
  EXPECT_NEAR(world_bounds_m(object_called(demo, "table_top")).max().z(), 0, 1e-12);
  EXPECT_GT(world_bounds_m(object_called(demo, "curtain")).min().z(), 0)
      << "the curtain touches the table";
}

TEST(CurtainDeployment, TwoHandsMeetTwoPanelsOfThePapersSize) {
  const Deployment deployment = load_deployment(kSource / "launch/deployments/curtain.yaml");
  std::size_t triangles = 0;
  for (const char* panel : {"left_panel", "right_panel"}) {
    const SceneObject& object = object_called(deployment.scene, panel);
    EXPECT_EQ(object.motion, Motion::cloth);
    EXPECT_EQ(object.reaction, Reaction::yield);
    triangles += mesh_of(object).triangles.size();
  }
  EXPECT_EQ(triangles, 720u) << "the paper's curtain";
  const auto captures = [](const Node& node) {
    const auto* capture = std::get_if<CaptureConfig>(&node.config);
    return capture && capture->synthetic.actor == SyntheticActor::parting_hands;
  };
  EXPECT_EQ(std::count_if(deployment.nodes.begin(), deployment.nodes.end(), captures), 1);
}

TEST(DemoScene, BlocksDoNotIntersect) {
  const Scene demo = test::load_scene(kSource / "scenes/demo/scene.yaml");
  std::vector<std::pair<std::string, Eigen::AlignedBox3d>> blocks;
  for (const SceneObject& object : demo.objects)
    if (object.reaction != Reaction::none) blocks.emplace_back(object.name, world_bounds_m(object));
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    EXPECT_GE(blocks[i].second.min().z(), -1e-12) << blocks[i].first;
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_FALSE(blocks[i].second.intersects(blocks[j].second))
          << blocks[i].first << ' ' << blocks[j].first;
  }
}

// The comments of the scene state these sizes and spacings.
TEST(PayloadScene, HasTheSpacingAndTheTrianglesOfItsComment) {
  const Scene scene = test::load_scene(kSource / "scenes/payload/scene.yaml");
  const SceneObject &pmt_box = object_called(scene, "pmt_box"),
                    &payload_a = object_called(scene, "payload_a");
  const Eigen::AlignedBox3d pmt_m = world_bounds_m(pmt_box), a_m = world_bounds_m(payload_a);
  EXPECT_TRUE(
      pmt_m.isApprox(Eigen::AlignedBox3d(Vector3d(-0.13, -0.13, 0), Vector3d(0.13, 0.13, 0.16))));
  EXPECT_NEAR(a_m.min().z() - pmt_m.max().z(), 0.18, 1e-12);
  EXPECT_EQ(mesh_of(payload_a).triangles.size(), 6176u);
  EXPECT_EQ(geometry::open_edges(mesh_of(pmt_box)), 0);
  // Without the shaft, less the segments between the 48 corners and the circle.
  const double shaft_m2 = 24 * 0.06 * 0.06 * std::sin(std::numbers::pi / 24);
  EXPECT_NEAR(geometry::enclosed_volume_m3(mesh_of(pmt_box)), (0.26 * 0.26 - shaft_m2) * 0.16,
              1e-7);
}

TEST(EngineScene, HasTheSpacingAndTheTrianglesOfItsComment) {
  const Scene scene = test::load_scene(kSource / "scenes/engine/scene.yaml");
  const SceneObject& battery = object_called(scene, "battery");
  EXPECT_NEAR(world_bounds_m(battery).min().x() -
                  world_bounds_m(object_called(scene, "engine_block")).max().x(),
              0.22, 1e-12);
  EXPECT_EQ(mesh_of(battery).triangles.size(), 5404u);
  const geometry::Mesh filter = mesh_of(object_called(scene, "oil_filter"));
  EXPECT_EQ(geometry::open_edges(filter), 0);
  EXPECT_NEAR(geometry::enclosed_volume_m3(filter),
              24 * 0.038 * 0.038 * std::sin(std::numbers::pi / 24) * 0.10, 1e-8);
}

TEST(ShippedDeployments, LoadIfSynthetic) {
  std::set<std::string> names;
  for (const auto& file : files_in(kSource / "launch" / "deployments", ".yaml")) {
    // These read footage.
    if (std::set<std::string>{"seated4cam", "balance4cam", "paper_files"}.contains(file.stem()))
      continue;
    const Deployment deployment = load_deployment(file);
    EXPECT_EQ(deployment.name, file.stem().string());
    names.insert(deployment.name);
    const Node* renderer = find_node(deployment, "rendering");
    EXPECT_NE(renderer, nullptr) << file;
    for (double t_s = 0; t_s < 20; t_s += 0.1)
      EXPECT_TRUE(eye_from_world_at(deployment.viewer, t_s).matrix().allFinite());
  }
  EXPECT_THAT(names, ::testing::IsSupersetOf({"demo", "paper", "ring16", "payload", "engine"}));
}

TEST(ShippedDeployments, PaperHasThePapersSettings) {
  const Deployment paper = load_deployment(kSource / "launch/deployments/paper.yaml",
                                           {{"backend", "sweep"}, {"planes", "96"}});
  EXPECT_EQ(recon_pinhole(paper.viewer).width_px, 320);
  EXPECT_EQ(render_pinhole(paper.viewer).width_px, 640);
  EXPECT_EQ(std::get<SimConfig>(find_node(paper, "simulation")->config).collision,
            CollisionBackend::paper);
  EXPECT_EQ(std::get<SimConfig>(find_node(paper, "simulation")->config).viewport_px, 10);
  EXPECT_EQ(std::get<SimConfig>(find_node(paper, "simulation")->config).window_px, 400);
  EXPECT_EQ(std::get<ReconConfig>(find_node(paper, "recon_a")->config).backend, HullBackend::sweep);
  EXPECT_EQ(std::get<ReconConfig>(find_node(paper, "recon_b")->config).sweep_planes, 96);
}

// The deployment that measures capture_node with files differs from the paper's in the sources
// only.
using PaperFiles = test::SceneFiles;  // with a temporary folder
TEST_F(PaperFiles, ArePaperWithImageFiles) {
  const Deployment paper = load_deployment(kSource / "launch/deployments/paper.yaml");
  for (const RigCamera& camera : paper.rig.cameras) {
    std::filesystem::create_directories(folder() / camera.name);
    for (const char* file : {"0000.jpg", "background_00.jpg"})
      write(camera.name + "/" + file, "an image");
  }
  const Deployment files = load_deployment(kSource / "launch/deployments/paper_files.yaml",
                                           {{"images", folder().string()}});
  const auto text_from = [](const std::string& file, const std::string& key) {
    std::ifstream in(kSource / "launch/deployments" / file);
    const std::string text(std::istreambuf_iterator<char>(in), {});
    return text.substr(text.find(key));
  };
  EXPECT_EQ(text_from("paper_files.yaml", "\n  - name: recon_a"),
            text_from("paper.yaml", "\n  - name: recon_a"));
  EXPECT_EQ(files.frame_rate_hz, paper.frame_rate_hz);
  EXPECT_EQ(files.rig.name, paper.rig.name);
  EXPECT_EQ(files.scene.name, paper.scene.name);
  EXPECT_EQ(recon_pinhole(files.viewer), recon_pinhole(paper.viewer));
  EXPECT_EQ(render_pinhole(files.viewer), render_pinhole(paper.viewer));
  for (const double t_s : {0.0, 1.0, 7.0})
    EXPECT_EQ(eye_from_world_at(files.viewer, t_s).matrix(),
              eye_from_world_at(paper.viewer, t_s).matrix());
  const auto capture = std::get<CaptureConfig>(find_node(files, "capture")->config);
  EXPECT_EQ(capture.precomputed_frames, 0);
  EXPECT_EQ(capture.sources.size(),
            std::get<CaptureConfig>(find_node(paper, "capture")->config).sources.size());
  for (const auto& [camera, source] : capture.sources)
    EXPECT_TRUE(std::holds_alternative<VideoSource>(source)) << camera;
}

TEST(Seated4cam, ReportsMissingRecording) {
  try {
    load_deployment(kSource / "launch/deployments/seated4cam.yaml");
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 1u) << error.what();
    EXPECT_EQ(error.problems()[0].what, "data is not set: pass --set data=FOLDER");
  }
}

TEST(Seated4cam, LoadsWithTheRecording) {
  if (!std::filesystem::exists(kRecording)) GTEST_SKIP() << "no recording at " << kRecording;
  const Deployment deployment = load_deployment(kSource / "launch/deployments/seated4cam.yaml",
                                                {{"data", kRecording.string()}});
  EXPECT_EQ(std::get<CaptureConfig>(find_node(deployment, "capture")->config).sources.size(), 4u);
}

TEST(Balance4cam, LoadsWithTheRecordingAndHasItsCalibration) {
  const auto recording = kRecording.parent_path() / "balance4cam";
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << "no recording at " << recording;
  const Deployment deployment = load_deployment(kSource / "launch/deployments/balance4cam.yaml",
                                                {{"data", recording.string()}});
  EXPECT_EQ(std::get<CaptureConfig>(find_node(deployment, "capture")->config).sources.size(), 4u);
  const YAML::Node calibration =
      YAML::LoadFile((recording / "calibration.json").string());  // JSON is YAML
  for (const RigCamera& camera : deployment.rig.cameras)
    for (int row = 0; row < 3; ++row)
      EXPECT_EQ(camera.camera_from_mount.translation()[row],
                calibration[camera.name]["t_m"][row].as<double>())
          << camera.name;
}

TEST(Seated4cam, RigEqualsTheCalibrationExactly) {
  if (!std::filesystem::exists(kRecording)) GTEST_SKIP() << "no recording at " << kRecording;
  const YAML::Node calibration =
      YAML::LoadFile((kRecording / "calibration.json").string());  // JSON is YAML
  const Rig rig = test::load_rig(kSource / "scenes/seated4cam/rig.yaml");
  ASSERT_EQ(rig.cameras.size(), calibration.size());
  for (const RigCamera& camera : rig.cameras) {
    const YAML::Node figures = calibration[camera.name];
    const YAML::Node k = figures["K"], d = figures["dist_k1k2p1p2k3"], t = figures["t_m"],
                     r = figures["R_world_to_cam"];
    EXPECT_EQ(camera.source,
              (geometry::Pinhole{figures["width"].as<int>(), figures["height"].as<int>(),
                                 k[0][0].as<double>(), k[1][1].as<double>(), k[0][2].as<double>(),
                                 k[1][2].as<double>()}));
    const geometry::LensDistortion& lens = camera.distortion;
    const double read[5] = {lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
    for (int i = 0; i < 5; ++i) EXPECT_EQ(read[i], d[i].as<double>());
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(camera.camera_from_mount.translation()[i], t[i].as<double>());
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(camera.camera_from_mount.linear()(i, j), r[i][j].as<double>(), 1e-14)
            << "orthonormalisation changes only the last digits";
    }
  }
}

TEST(Seated4cam, EveryCameraSeesTheWholePerson) {
  const Rig rig = test::load_rig(kSource / "scenes/seated4cam/rig.yaml");
  const Eigen::AlignedBox3d person_m(Vector3d(0.04, 0.04, 0.0), Vector3d(0.66, 0.96, 1.36));
  EXPECT_TRUE(rig.volume_m.contains(person_m));
  // One lower corner of the box, which contains neither person nor chair, is outside cam3's image.
  for (const RigCamera& camera : rig.cameras)
    EXPECT_GT(visible_fraction(published_camera(camera), person_m), 0.999) << camera.name;
}

}  // namespace
}  // namespace fivepipe::config
