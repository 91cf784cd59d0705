// The sources of cameras, and the checks of a deployment's nodes against its rig and viewer.
#include <unistd.h>

#include <array>
#include <utility>

#include "tests/support/deployment_files.h"
#include "tests/support/gltf/glb_file.h"
#include "tests/support/gltf/image_bytes.h"

namespace fivepipe::config {
namespace {

using ::testing::ElementsAre;

class CameraSources : public test::DeploymentFile {
 protected:
  std::vector<std::string> problems_of_nodes(const std::string& nodes) {
    return problems(with_nodes(nodes));
  }
  std::vector<std::string> problems_of_sources(const std::string& left) {
    return problems_of_nodes("  - {name: c, program: capture_node, sources: {right: synthetic, " +
                             left + "}}\n");
  }
};

// `colour` and `nothing` look away from the volume, which only a camera that gives shape must see.
const std::string kThreeCameras = R"(
name: three
volume_m: {min: [-0.5, -0.5, 0], max: [0.5, 0.5, 1]}
cameras:
  - {name: shape, gives_colour: false, image_size_px: [320, 240], horizontal_fov_deg: 60,
     look_at: {eye_m: [-2, 0, 1], target_m: [0, 0, 0.5]}}
  - {name: colour, gives_shape: false, image_size_px: [320, 240], horizontal_fov_deg: 60,
     look_at: {eye_m: [-2, 0, 1], target_m: [-4, 0, 0.5]}}
  - {name: nothing, gives_shape: false, gives_colour: false, image_size_px: [320, 240],
     horizontal_fov_deg: 60, look_at: {eye_m: [-2, 0, 1], target_m: [-4, 0, 0.5]}}
)";

TEST_F(CameraSources, EachCameraThatGivesShapeOrColourNeedsOne) {
  write("rig.yaml", kThreeCameras);
  const auto with = [](const std::string& sources) {
    return with_nodes("  - {name: c, program: capture_node, sources: " + sources + "}\n");
  };
  std::vector<std::string> cameras;
  const Deployment d = load(with("synthetic"));
  for (const auto& [camera, source] : std::get<CaptureConfig>(d.nodes[0].config).sources)
    cameras.push_back(camera);
  EXPECT_THAT(cameras, ElementsAre("colour", "shape"));
  for (const auto& [camera, other] : {std::pair{"colour", "shape"}, {"shape", "colour"}})
    EXPECT_THAT(
        problems(with(std::string("{") + camera + ": synthetic}")),
        ElementsAre(std::string("deployment.yaml:7:3: camera ") + other +
                    " of rig three has no source: add it to the sources of a capture node"));
}

TEST_F(CameraSources, ATextOtherThanSyntheticIsOneProblem) {
  EXPECT_THAT(problems_of_nodes("  - {name: c, program: capture_node, sources: films}\n"),
              ElementsAre("deployment.yaml:7:47: sources must be one of synthetic; is \"films\""));
  EXPECT_THAT(problems_of_sources("left: film"),
              ElementsAre("deployment.yaml:7:72: left must be one of synthetic; is \"film\""));
}

TEST_F(CameraSources, AV4l2CameraHasNoVideoAndNoUnknownKeys) {
  write("plate.png", "any content");
  EXPECT_THAT(problems_of_sources("left: {v4l2: 0, background: plate.png}"), ElementsAre());
  EXPECT_THAT(problems_of_sources("left: {v4l2: 0, background: none.png}"),
              ElementsAre("deployment.yaml:7:94: background " + (folder() / "none.png").string() +
                          ": there is no such file"));
  EXPECT_THAT(
      problems_of_sources("left: {v4l2: 0, video: plate.png}"),
      ElementsAre("deployment.yaml:7:79: video and v4l2 are both set: a camera has one source"));
  EXPECT_THAT(problems_of_sources("left: {v4l2: 0, backgroun: plate.png}"),
              ElementsAre("deployment.yaml:7:82: unknown key backgroun: did you mean background?"));
  EXPECT_THAT(problems_of_sources("left: {v4l2: 0, format: YU12, rate_hz: 0.5}"),
              ElementsAre(::testing::HasSubstr("rate_hz must be")));
  for (const char* format : {"MJPEG", "YU", "\"Y16\\x01\""})
    EXPECT_THAT(problems_of_sources("left: {v4l2: 0, format: " + std::string(format) + "}"),
                ElementsAre(::testing::HasSubstr("format must have four characters, such as MJPG")))
        << format;
}

TEST_F(CameraSources, StreamsAndGenicamCamerasAreReadLikeV4l2Cameras) {
  write("plate.png", "any content");
  const auto source = [&](const std::string& keys) {
    const Deployment d =
        load(with_nodes("  - {name: c, program: capture_node, sources: {right: synthetic, left: {" +
                        keys + "}}}\n"));
    return std::get<CaptureConfig>(d.nodes[0].config).sources.at("left");
  };
  const auto pipeline =
      std::get<GstreamerSource>(source("gstreamer: \"v4l2src ! jpegdec\", background: plate.png"));
  EXPECT_EQ(pipeline.pipeline, "v4l2src ! jpegdec");
  EXPECT_EQ(std::get<LearnedBackground>(pipeline.key).file, (folder() / "plate.png").string());
  const auto rtsp =
      std::get<RtspSource>(source("rtsp: \"rtsp://u:p@10.0.0.2:554/a?b=1\", background_frames: 9"));
  EXPECT_EQ(rtsp.url, "rtsp://u:p@10.0.0.2:554/a?b=1");
  EXPECT_EQ(std::get<LearnedBackground>(rtsp.key).frames, 9);
  EXPECT_EQ(std::get<RtspSource>(source("rtsp: rtsps://camera")).url, "rtsps://camera");
  auto genicam = std::get<GenicamSource>(source("genicam: 10.0.0.3"));
  EXPECT_EQ(genicam.camera, "10.0.0.3");
  EXPECT_FALSE(genicam.exposure_us);
  EXPECT_FALSE(genicam.gain_db);
  EXPECT_EQ(std::get<LearnedBackground>(genicam.key).frames, 30);
  genicam = std::get<GenicamSource>(
      source("genicam: Maker-7, exposure_us: 5000, gain_db: 1.5, chroma_key: {}"));
  EXPECT_EQ(genicam.exposure_us, 5000);
  EXPECT_EQ(genicam.gain_db, 1.5);
  EXPECT_TRUE(std::holds_alternative<ChromaKey>(genicam.key));
  EXPECT_TRUE(std::holds_alternative<ChromaKey>(key_of(genicam)));
  EXPECT_TRUE(std::holds_alternative<LearnedBackground>(key_of(SyntheticSource{})));
}

TEST_F(CameraSources, WrongStreamsAndGenicamCamerasAreProblems) {
  const auto problem = [&](const std::string& keys) {
    const std::vector<std::string> found = problems_of_sources("left: {" + keys + "}");
    EXPECT_EQ(found.size(), 1u) << keys;
    return found.empty() ? "" : found[0].substr(found[0].find(": ") + 2);
  };
  EXPECT_EQ(problem("gstreamer: \" \""),
            "gstreamer is empty: write the elements of a pipeline without its sink, such as "
            "\"v4l2src device=/dev/video0\"");
  for (const char* url : {"http://10.0.0.2", "10.0.0.2", "'rtsp://a b'", "'rtsp://a\"b'",
                          "\"rtsp://a'b\"", "'rtsp://a\\b'", "\"rtsp://a\\nb\"", "rtsp://ä"})
    EXPECT_EQ(problem(std::string("rtsp: ") + url),
              "rtsp must be an address such as rtsp://192.168.1.20:554/stream, without quotes, "
              "spaces and other characters than ASCII (write them as %20)")
        << url;
  EXPECT_EQ(problem("genicam: \"\""),
            "genicam is empty: write the name, the serial number or the address of the camera "
            "(`fivepipe cameras` lists them)");
  EXPECT_EQ(problem("genicam: a, rtsp: rtsp://b"),
            "rtsp and genicam are both set: a camera has one source");
  EXPECT_EQ(problem("v4l2: 0, gstreamer: a"),
            "v4l2 and gstreamer are both set: a camera has one source");
  EXPECT_EQ(problem("v4l2: 0, exposure_us: 5").substr(0, 24), "unknown key exposure_us;");
  EXPECT_EQ(problem("genicam: a, chroma_key: {}, background_frames: 5"),
            "background_frames is only for a camera that learns its background at the start");
}

// Its first picture may have any number: first_frame counts from there.
TEST_F(CameraSources, ASequenceNeedsOnePicture) {
  for (const char* file : {"plate.png", "a_0107.png", "b_   7.png", "plate_30.png"})
    write(file, "any content");
  const auto found = [&](const std::string& video, const std::string& first_frame = "0",
                         const std::string& background = "plate.png") {
    return problems_of_sources("left: {video: \"" + video + "\", background: " + background +
                               ", first_frame: " + first_frame + "}")
        .empty();
  };
  EXPECT_TRUE(found("a_%04d.png"));
  EXPECT_TRUE(found("a_%010d.png")) << "the width does not matter";
  EXPECT_TRUE(found("a_%d.png", "7"));
  EXPECT_TRUE(found("a_%d.png", "0", "plate_%d.png"));
  EXPECT_FALSE(found("a_%d.png", "0", "plate%d.png"));
  EXPECT_FALSE(found("a_%s.png"));
  EXPECT_FALSE(found("b_%4d.png"));
  EXPECT_FALSE(found("c_%d.png"));
}

TEST_F(CameraSources, FilesAreCheckedOnTheHostOfTheNode) {
  const auto with_host = [&](const std::string& host) {
    return problems_of_nodes("  - {name: c, program: capture_node, host: " + host +
                             ", sources: {right: synthetic, left: {video: /no/l.avi, background: "
                             "/no/b.avi}}}\n")
        .size();
  };
  std::array<char, 256> own{};
  ASSERT_EQ(gethostname(own.data(), own.size()), 0);
  EXPECT_EQ(with_host('"' + std::string(own.data()) + '"'), 2u);
  EXPECT_EQ(with_host("elsewhere"), 0u);
}

// One fault is one problem: the rig's cameras are unknown then.
TEST_F(CameraSources, AreNotCheckedAgainstAnUnusableRig) {
  const std::string text =
      with_nodes("  - {name: c, program: capture_node, sources: {absent: synthetic}}\n");
  write("rig.yaml", test::kGoodRig + "colour: red\n");
  EXPECT_THAT(
      problems(text),
      ElementsAre("rig.yaml:15:1: unknown key colour; known keys: name, volume_m, cameras"));
  std::string without_rig = text;
  without_rig.erase(without_rig.find("rig: rig.yaml\n"), 14);
  EXPECT_THAT(problems(without_rig),
              ElementsAre("deployment.yaml:1:1: rig is missing in the file"));
}

TEST_F(CameraSources, SettingsOfTheSyntheticWorldThatMustAgree) {
  for (const std::string setting : {"seed: 2", "period_s: 5", "cast_shadow: false"})
    EXPECT_EQ(problems_of_nodes("  - {name: c, program: capture_node, sources: {left: synthetic}}\n"
                                "  - {name: d, program: capture_node, sources: {right: synthetic}, "
                                "synthetic: {" +
                                setting + "}}\n")
                  .size(),
              1u)
        << setting;
  EXPECT_THAT(problems_of_nodes("  - {name: c, program: capture_node, sources: {left: {v4l2: 0}}, "
                                "synthetic: {seed: 3}}\n"
                                "  - {name: d, program: capture_node, sources: {right: synthetic}, "
                                "synthetic: {noise_sigma_levels: 1}}\n"),
              ElementsAre())
      << "only one node has synthetic cameras";
}

TEST_F(CameraSources, NodesWithoutNamesAreNotDuplicates) {
  EXPECT_THAT(problems_of_nodes("  - {program: recon_node}\n  - {program: sim_node}\n"),
              ElementsAre("deployment.yaml:7:5: name is missing in nodes[0]",
                          "deployment.yaml:8:5: name is missing in nodes[1]"));
}

TEST_F(CameraSources, CoresThatAreFarApartInTheListAreDuplicates) {
  EXPECT_THAT(problems_of_nodes("  - {name: s, program: sim_node, cores: [3, 1, 3]}\n"),
              ElementsAre("deployment.yaml:7:41: cores contains core 3 twice"));
}

TEST_F(CameraSources, AViewportMayFillTheWindow) {
  EXPECT_THAT(
      problems_of_nodes("  - {name: s, program: sim_node, viewport_px: 20, window_px: 20}\n"),
      ElementsAre());
}

TEST_F(CameraSources, TilesHaveAtLeastAPixelAndWorkersATile) {
  const auto problems_with = [&](const std::string& size_px) {
    std::string text = with_nodes("  - {name: r, program: recon_node}\n");
    return problems(text.insert(text.find("nodes:"), "  recon_size_px: " + size_px + "\n"));
  };
  EXPECT_THAT(problems_with("[8, 6]"), ElementsAre());
  for (const auto& [size_px, pixels] :
       {std::pair<std::string, std::string>{"[7, 6]", "7 x 6"}, {"[8, 5]", "8 x 5"}})
    EXPECT_THAT(problems_with(size_px),
                ElementsAre("deployment.yaml:8:5: more tiles (8 x 6) than pixels (" + pixels +
                            "): reduce tile_columns or tile_rows, or increase recon_size_px"));
  // One of 64 x 64 in one view is possible; a light's view or a second eye doubles their number.
  const auto problems_of_tiles = [&](const std::string& rows, const std::string& viewer) {
    std::string text = with_nodes(
        "  - {name: r, program: recon_node, tile_columns: 64, tile_rows: " + rows + "}\n");
    return problems(text.insert(text.find("nodes:"), "  recon_size_px: [640, 480]\n" + viewer));
  };
  EXPECT_THAT(problems_of_tiles("64", ""), ElementsAre());
  EXPECT_THAT(problems_of_tiles("65", ""),
              ElementsAre("deployment.yaml:8:5: 64 x 65 tiles in each of 1 view are 4160, a frame "
                          "may have 4096: reduce tile_columns or tile_rows"));
  EXPECT_THAT(problems_of_tiles("32", "  stereo: {eye_distance_m: 0.063}\n"), ElementsAre());
  EXPECT_THAT(problems_of_tiles("33", "  stereo: {eye_distance_m: 0.063}\n"),
              ElementsAre("deployment.yaml:9:5: 64 x 33 tiles in each of 2 views are 4224, a frame "
                          "may have 4096: reduce tile_columns or tile_rows"));
  for (const int workers : {4, 5}) {
    std::string nodes;
    for (int worker = 0; worker < workers; ++worker)
      nodes += "  - {name: r" + std::to_string(worker) +
               ", program: recon_node, tile_columns: 2, tile_rows: 3, worker: " +
               std::to_string(worker) + ", workers: " + std::to_string(workers) + "}\n";
    EXPECT_EQ(problems_of_nodes(nodes).size(), workers == 4 ? 0u : 1u);
  }
}

class DeploymentParts : public test::DeploymentFile {};

// A recording contains these files, so that its nodes can be started on another machine.
TEST_F(DeploymentParts, ListsTexturesBesideMeshesOnce) {
  test::GlbContent content{{test::glb_rectangle(1, 1, 0), test::glb_rectangle(1, 1, 1)}, {}, R"(
 "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
               {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 0}}}],
 "textures": [{"source": 0}], "images": [{"uri": "wood.png"}])"};
  write("wood.png", test::png_header(2, 2));
  write("part.glb", test::glb_of(content));
  write(
      "scene.yaml",
      test::kGoodScene + "  - name: part\n    position_m: [0, 0, 0]\n    mesh: {file: part.glb}\n");
  std::vector<std::string> names;
  for (const auto& file : load(with_nodes("  - {name: s, program: sim_node}\n")).files)
    names.push_back(file.filename());
  EXPECT_THAT(names,
              ElementsAre("deployment.yaml", "rig.yaml", "scene.yaml", "part.glb", "wood.png"));
}

// Without them, a recording's mesh has no colours, or cannot be read.
TEST_F(DeploymentParts, ListsTheMaterialFilesAndBuffersThatMeshesName) {
  write("wood.png", test::png_header(2, 2));
  write("part.mtl", "newmtl wood\nmap_Kd wood.png\n");
  write("part.obj",
        "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl wood\nf 1/1 2/1 3/1\n");
  write("scene.yaml", test::kGoodScene +
                          "  - name: part\n    position_m: [0, 0, 0]\n    mesh: {file: part.obj, "
                          "unit: m}\n");
  std::vector<std::string> names;
  for (const auto& file : load(with_nodes("  - {name: s, program: sim_node}\n")).files)
    names.push_back(file.filename());
  EXPECT_THAT(names, ElementsAre("deployment.yaml", "rig.yaml", "scene.yaml", "part.obj",
                                 "part.mtl", "wood.png"));
}

TEST_F(DeploymentParts, ListsTheFilesThatItReads) {
  write("head.csv",
        "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m\n0,0,-1,0.5,0,0,0\n");
  write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("scene.yaml", test::kGoodScene +
                          "  - name: part\n    position_m: [0, 0, 0]\n    mesh: {file: part.obj, "
                          "unit: cm}\n");
  std::string text = with_nodes("  - {name: s, program: sim_node}\n");
  const auto files_of = [&](const Deployment& d) {
    std::vector<std::string> names;
    for (const std::filesystem::path& file : d.files) names.push_back(file.filename());
    return names;
  };
  EXPECT_THAT(files_of(load(text)),
              ElementsAre("deployment.yaml", "rig.yaml", "scene.yaml", "part.obj"));
  const std::size_t path = text.find("path:");
  text.replace(path, text.find('\n', path) - path, "file: head.csv");
  EXPECT_THAT(files_of(load(text)),
              ElementsAre("deployment.yaml", "rig.yaml", "scene.yaml", "part.obj", "head.csv"));
}

TEST_F(DeploymentParts, TheViewerHasOnePathAndOnlyKnownKeys) {
  const std::string text = with_nodes("  - {name: s, program: sim_node}\n");
  const auto problems_with = [&](const std::string& keys) {
    std::string changed = text;
    return problems(changed.insert(changed.find("nodes:"), keys));
  };
  write("head.csv",
        "t_s,eye_x_m,eye_y_m,eye_z_m,target_x_m,target_y_m,target_z_m\n0,0,-1,0.5,0,0,0\n");
  EXPECT_THAT(problems_with("  file: head.csv\n"),
              ElementsAre("deployment.yaml:6:9: path and file are both set: remove one"));
  EXPECT_THAT(problems_with("  far_km: 1\n"),
              ElementsAre("deployment.yaml:6:3: unknown key far_km: use far_m"));
  EXPECT_THAT(problems_with("  near_m: 2\n  far_m: 2\n"),
              ElementsAre("deployment.yaml:5:3: near_m (2) must be less than far_m (2)"));
  std::string with_unit = text;
  with_unit.replace(with_unit.find("target_m"), 8, "target_m: [0, 0, 0], target_cm");
  EXPECT_THAT(problems(with_unit),
              ElementsAre("deployment.yaml:5:53: unknown key target_cm: use target_m"));
}

}  // namespace
}  // namespace fivepipe::config
