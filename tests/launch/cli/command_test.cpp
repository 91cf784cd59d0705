// Runs the built `fivepipe` command.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/base/machine.h"
#include "common/base/version.h"
#include "common/config/mesh/step_module.h"
#include "tests/support/capture/pictures.h"
#include "tests/support/deployments.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/shell.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

namespace fs = std::filesystem;

using Answer = test::ShellAnswer;

Answer answer_of(const std::string& line) { return test::shell(line + " 2>&1"); }
Answer fivepipe(const std::string& arguments) {
  return answer_of(FIVEPIPE_BINARY_DIR "/fivepipe " + arguments);
}

TEST(Command, UsageErrorsExitWithTwo) {
  for (const char* arguments :
       {"", "fly", "up", "up demo.yaml --duration -3", "up demo.yaml --set novalue",
        "up demo.yaml --set =x", "up demo.yaml --domain 231", "top --once --domain 231",
        "simulation pause --domain 231", "top --surely-not", "bench", "bench no_such_suite"}) {
    const Answer answer = fivepipe(arguments);
    EXPECT_EQ(answer.exit_code, 2) << arguments << "\n" << answer.text;
    EXPECT_FALSE(answer.text.empty()) << arguments;
  }
}

// Also if the deployment loops or has precomputed frames.
TEST(Command, MapsDoNotStartAFileAgain) {
  const test::TestFolder folder;
  test::write_pictures(folder.path, 3);
  const std::string deployment = test::changed_deployment(
      folder.path, "sources: synthetic",
      "loop: true, precomputed_frames: 2, sources: " + test::picture_sources());
  const std::string maps = "maps " + deployment + " --out " + (folder.path / "out").string();
  const Answer one = fivepipe(maps + " --frame 1");
  EXPECT_EQ(one.exit_code, 0) << one.text;
  EXPECT_TRUE(test::contains(one.text, "left: 10.9 % object pixels")) << one.text;
  EXPECT_TRUE(test::contains(test::text_of(folder.path / "out" / "cameras.txt"), "frame 1\n"));
  fs::remove_all(folder.path / "out");
  for (const std::string beyond : {"3", "9999"}) {
    const Answer none = fivepipe(maps + " --frame " + beyond);
    EXPECT_EQ(none.exit_code, 1);
    EXPECT_TRUE(test::contains(
        none.text, "camera left: no image of frame " + beyond + ": its images have ended"))
        << none.text;
    EXPECT_FALSE(fs::exists(folder.path / "out"));
  }
}

TEST(Command, MissingDeploymentIsAConfigurationError) {
  const Answer answer = fivepipe("up /no/such/deployment.yaml");
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_TRUE(test::contains(answer.text, "/no/such/deployment.yaml")) << answer.text;
}

TEST(Command, AnOutputFolderThatCannotBeMadeIsAUsageError) {
  const test::TestFolder folder;
  std::ofstream(folder.path / "file") << "no folder";
  const Answer answer =
      fivepipe("up demo --duration 1 --domain 230 --out " + (folder.path / "file/x").string());
  EXPECT_EQ(answer.exit_code, 2);
  // A build with assertions warns before.
  EXPECT_TRUE(
      answer.text.ends_with("--out " + (folder.path / "file/x").string() +
                            ": cannot create the folder: Not a directory; choose another\n"))
      << answer.text;
}

TEST(Command, AFileThatIsAbsentIsNamedAsElsewhere) {
  for (const char* command : {"info ", "replay ", "ls ", "echo HeadPose --from "}) {
    const Answer answer = fivepipe(command + std::string("nothing.mcap"));
    EXPECT_EQ(answer.exit_code, 2);
    EXPECT_TRUE(test::contains(answer.text, "nothing.mcap: there is no such file")) << answer.text;
  }
  EXPECT_TRUE(test::contains(fivepipe("info /").text, "/: is a directory, not a file"));
}

TEST(Command, AnUnknownCommandOfTheSimulationIsNamed) {
  const Answer answer = fivepipe("simulation stop");
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_TRUE(test::contains(answer.text, "'stop' is not pause, resume or reset")) << answer.text;
}

TEST(Command, HelpOfEverySubcommandHasAnExample) {
  for (const char* subcommand : {"",
                                 "up ",
                                 "top ",
                                 "record ",
                                 "replay ",
                                 "info ",
                                 "ls ",
                                 "echo ",
                                 "hz ",
                                 "simulation ",
                                 "doctor ",
                                 "bench ",
                                 "maps ",
                                 "segment ",
                                 "study ",
                                 "study new ",
                                 "study register ",
                                 "study run ",
                                 "study edit ",
                                 "study list ",
                                 "study report ",
                                 "study forget ",
                                 "study space ",
                                 "study what-if ",
                                 "export ",
                                 "cameras ",
                                 "bench simulation ",
                                 "bench compare "}) {
    const Answer answer = fivepipe(std::string(subcommand) + "--help");
    EXPECT_EQ(answer.exit_code, 0) << answer.text;
    EXPECT_TRUE(test::contains(answer.text, "Example")) << subcommand << "\n" << answer.text;
    EXPECT_TRUE(test::contains(answer.text, "fivepipe " + std::string(subcommand))) << answer.text;
  }
}

TEST(Command, MapsOfOneFrameAreImagesAndCameras) {
  const test::TestFolder test_folder;
  const fs::path folder = test_folder.path / "maps";
  const Answer answer =
      fivepipe("maps " + test::kSmallDeployment + " --frame 30 --out " + folder.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  std::ifstream cameras(folder / "cameras.txt");
  int count = 0;
  for (std::string line; std::getline(cameras, line);) {
    if (line.empty() || line.front() == '#') continue;
    std::ifstream image(folder / (line.substr(0, line.find(' ')) + ".pbm"), std::ios::binary);
    std::string magic;
    image >> magic;
    EXPECT_EQ(magic, "P4") << line;
    ++count;
  }
  EXPECT_GE(count, 3);
  EXPECT_EQ(fivepipe("maps /no/such.yaml --out " + folder.string()).exit_code, 2);
  EXPECT_EQ(fivepipe("maps").exit_code, 2);
}

// A deployment with pictures of 50x40 px. Picture k has a bright rectangle of 10x5 px, k rows lower
// than in picture 0.
class PicturesDeployment {
 public:
  PicturesDeployment() {
    std::ofstream(folder / "rig.yaml")
        << "name: two\nvolume_m: {min: [-0.4, -0.4, -0.4], max: [0.4, 0.4, 0.4]}\ncameras:\n"
           "  - {name: left, image_size_px: [50, 40], horizontal_fov_deg: 90,\n"
           "     look_at: {eye_m: [0, -1, 0], target_m: [0, 0, 0]}}\n"
           "  - {name: above, image_size_px: [50, 40], horizontal_fov_deg: 90, gives_shape: "
           "false,\n"
           "     look_at: {eye_m: [0, -1, 1], target_m: [0, 0, 0]}}\n"
           "  - {name: right, image_size_px: [50, 40], horizontal_fov_deg: 90,\n"
           "     look_at: {eye_m: [1, 0, 0], target_m: [0, 0, 0]}}\n";
    std::ofstream(folder / "scene.yaml")
        << "name: one\nobjects: [{name: box, box: {size_m: [1, 1, 1]}, position_m: [9, 9, 9]}]\n";
    for (int k = 0; k < 3; ++k) {
      std::string pixels(50 * 40 * 3, '<');
      for (int v = 8 + k; v < 13 + k; ++v) pixels.replace(std::size_t(150 * v + 60), 30, 30, 'z');
      std::ofstream(folder / ("f" + std::to_string(k) + ".ppm")) << "P6 50 40 255\n" << pixels;
    }
    std::ofstream(folder / "empty.ppm") << "P6 50 40 255\n" << std::string(50 * 40 * 3, '<');
    write_sources("f%d.ppm");
  }
  // `above`: the pictures of the camera that gives only colour. `loop`: true or false.
  void write_sources(const std::string& above, const std::string& loop = "false") const {
    write_deployment("capture_node",
                     "left: {video: \"${data}f%d.ppm\", background: empty.ppm}, "
                     "above: {video: " +
                         above +
                         ", background: empty.ppm}, "
                         "right: {video: f%d.ppm, background: empty.ppm}",
                     loop);
  }
  void write_deployment(const std::string& program, const std::string& sources,
                        const std::string& loop = "false") const {
    std::ofstream(folder / "deployment.yaml")
        << "name: pictures\nrig: rig.yaml\nscene: scene.yaml\nframe_rate_hz: 24\nviewer:\n"
           "  path: [{t_s: 0, eye_m: [0, -0.8, 0], target_m: [0, 0, 0]}]\n"
           "settings: {data: ./}\nnodes:\n"
           "  - {name: first, program: "
        << program
        << (sources.empty() ? "" : ", loop: " + loop + ",\n     sources: {" + sources + "}")
        << "}\n";
  }
  Answer maps(const std::string& arguments) const {
    return fivepipe("maps " + (folder / "deployment.yaml").string() + " --out " + out.string() +
                    " " + arguments);
  }

  const test::TestFolder test_folder;
  const fs::path folder = test_folder.path;
  const fs::path out = folder / "new" / "maps";
};

TEST(Command, MapsHaveTheObjectPixelsAndTheCamerasOfOneFrame) {
  const PicturesDeployment pictures;
  for (const int frame : {0, 2}) {
    const Answer answer = pictures.maps(frame == 0 ? "" : "--frame 2");
    ASSERT_EQ(answer.exit_code, 0) << answer.text;
    for (const char* line :
         {"left: 2.5 % object pixels, camera at (", "right: 2.5 % object pixels, camera at (",
          ": source and background, 33 %", ": source and background, 100 %   \n"})
      EXPECT_TRUE(test::contains(answer.text, line)) << line << '\n' << answer.text;
    EXPECT_FALSE(test::contains(answer.text, "above: 2.5")) << answer.text;
    std::string pixels = "P4\n50 40\n" + std::string(7 * 40, '\0');
    for (int v = 8 + frame; v < 13 + frame; ++v)  // columns 20 to 29
      pixels.replace(pixels.size() - std::size_t(7 * (40 - v)) + 2, 2, "\x0f\xfc");
    EXPECT_EQ(test::text_of(pictures.out / "left.pbm"), pixels);
    EXPECT_EQ(test::text_of(pictures.out / "right.pbm"), pixels);
    EXPECT_FALSE(fs::exists(pictures.out / "above.pbm"));
    std::ifstream cameras(pictures.out / "cameras.txt");
    std::string line;
    std::getline(cameras, line);
    EXPECT_EQ(line,
              "# name width height fx fy cx cy [px], three rows of camera_from_world [m]: "
              "pictures, frame " +
                  std::to_string(frame));
    for (const auto& [name, pose] : {std::pair<std::string, std::vector<double>>{
                                         "left", {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 1}},
                                     {"right", {0, 1, 0, 0, 0, 0, -1, 0, -1, 0, 0, 1}}}) {
      std::string found;
      cameras >> found;
      EXPECT_EQ(found, name);
      std::vector<double> numbers = {50, 40, 25, 25, 24.5, 19.5};
      numbers.insert(numbers.end(), pose.begin(), pose.end());
      for (const double expected : numbers) {
        double number = NAN;
        cameras >> number;
        EXPECT_NEAR(number, expected, 1e-9) << name;
      }
    }
    EXPECT_FALSE(cameras >> line) << line;
  }
}

TEST(Command, MapsAreOfAllCaptureNodes) {
  const PicturesDeployment pictures;
  pictures.write_deployment("capture_node",
                            "above: {video: f%d.ppm, background: empty.ppm}, "
                            "left: {video: f%d.ppm, background: empty.ppm}}}\n"
                            "  - {name: second, program: capture_node, loop: false,\n"
                            "     sources: {right: {video: f%d.ppm, background: empty.ppm}");
  const Answer answer = pictures.maps("--frame 1");
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_EQ(test::text_of(pictures.out / "left.pbm"), test::text_of(pictures.out / "right.pbm"));
  EXPECT_TRUE(test::contains(answer.text, "right: 2.5 % object pixels, camera at ("))
      << answer.text;
}

// A camera that gives only colour may have fewer pictures.
TEST(Command, MapsNeedNoPictureOfACameraThatGivesOnlyColour) {
  const PicturesDeployment pictures;
  for (const char* name : {"colour0.ppm", "colour1.ppm"})
    fs::copy(pictures.folder / "f0.ppm", pictures.folder / name);
  const auto map_of_the_last_frame = [&] {
    const Answer answer = pictures.maps("--frame 2");
    EXPECT_EQ(answer.exit_code, 0) << answer.text;
    return test::text_of(pictures.out / "left.pbm");
  };
  const std::string map = map_of_the_last_frame();
  pictures.write_sources("colour%d.ppm", "true");
  EXPECT_EQ(map_of_the_last_frame(), map);
}

TEST(Command, MapsOfAFrameAfterTheLastAreRefused) {
  const PicturesDeployment pictures;
  EXPECT_EQ(pictures.maps("--frame 2").exit_code, 0);
  const Answer after = pictures.maps("--frame 3");
  EXPECT_EQ(after.exit_code, 1) << after.text;
  EXPECT_TRUE(test::contains(after.text, ": no image of frame 3: ")) << after.text;
}

TEST(Command, MapsOfARangeHaveAFolderEachAndOverlays) {
  const PicturesDeployment pictures;
  const Answer answer = pictures.maps("--frames 0:2:2 --overlays");
  ASSERT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "frame 2, left: 2.5 % object pixels, camera at ("))
      << answer.text;
  for (const std::string name : {"frame_000000", "frame_000002"}) {
    EXPECT_TRUE(fs::exists(pictures.out / name / "cameras.txt"));
    const cv::Mat picture = cv::imread((pictures.out / name / "left_overlay.png").string());
    ASSERT_EQ(picture.size(), cv::Size(50, 40)) << name;
    const int top = name == "frame_000000" ? 8 : 10;
    EXPECT_EQ(picture.at<cv::Vec3b>(top, 20), cv::Vec3b(255, 255, 255)) << "the outline";
    // The lower edge of the volume crosses the object of the other frame in row 12.
    if (top == 8) {
      EXPECT_EQ(picture.at<cv::Vec3b>(10, 22), cv::Vec3b(81, 81, 188)) << "half red";
    } else {
      EXPECT_GT(picture.at<cv::Vec3b>(12, 22)[1], 188) << "green";
    }
    EXPECT_EQ(picture.at<cv::Vec3b>(top + 9, 22), cv::Vec3b(36, 36, 36)) << "darkened";
    // The z axis of the world, which the camera sees in the middle of its image.
    const cv::Vec3b axis = picture.at<cv::Vec3b>(top + 9, 25);
    EXPECT_GT(axis[0], axis[2] + 100) << "blue";
  }
  EXPECT_FALSE(fs::exists(pictures.out / "frame_000001"));
  EXPECT_EQ(pictures.maps("--frames 0:9").exit_code, 1);
  for (const std::string wrong : {"2:1", "a", "1:", ":2", "0:2:0", "0:1:1:1", "1-2", "''"})
    EXPECT_EQ(pictures.maps("--frames " + wrong).exit_code, 2) << wrong;
}

TEST(Command, SegmentWritesMasksOverlaysAndSettings) {
  const PicturesDeployment pictures;
  const fs::path folder = pictures.folder, out = folder / "segmented";
  const auto segment = [&](const std::string& arguments) {
    return fivepipe("segment " + (folder / "f%d.ppm").string() + " --out " + out.string() + " " +
                    arguments);
  };
  const std::string background = "--background " + (folder / "empty.ppm").string() + " ";
  const Answer answer = segment(background);
  ASSERT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "50x40, background from 1 image\n")) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "3 frames, 2.5 to 2.5 % object pixels\n"));
  for (int k = 0; k < 3; ++k) {
    const std::string name = "00000" + std::to_string(k) + ".png";
    const cv::Mat mask = cv::imread((out / "masks" / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(mask.type(), CV_8UC1);
    EXPECT_EQ(cv::countNonZero(mask), 50);
    EXPECT_EQ(cv::countNonZero(mask(cv::Rect(20, 8 + k, 10, 5)) == 255), 50) << k;
    EXPECT_EQ(cv::imread((out / "overlays" / name).string()).size(), mask.size());
  }
  // The settings, their errors, and their place.
  EXPECT_EQ(segment(background + "--frames 1 --set min_object_px=51 --set jitter_px=0").exit_code,
            0);
  EXPECT_EQ(cv::countNonZero(cv::imread((out / "masks/000001.png").string(), 0)), 0);
  for (const char* pictures_of : {"masks", "overlays"})
    EXPECT_FALSE(fs::exists(out / pictures_of / "000002.png")) << "of the run before";
  EXPECT_EQ(test::text_of(out / "segmentation.yaml"), "min_object_px: 51\njitter_px: 0\n");
  const Answer wrong = segment(background + "--set jitter_px=0 --set jitter=1");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(test::contains(wrong.text, "segmentation.yaml:2:")) << wrong.text;
  EXPECT_TRUE(fs::exists(out / "masks/000001.png")) << "kept until new pictures can be made";
  EXPECT_TRUE(test::contains(segment("--set volume_m=rig").text, "volume_m needs a rig")) << "rig";
  // Without a background file, the first images are the background.
  EXPECT_EQ(segment("--background-frames 1 --frames 0").exit_code, 0);
  EXPECT_EQ(cv::countNonZero(cv::imread((out / "masks/000000.png").string(), 0)), 0);
  // A region of interest: the left half of the picture.
  cv::Mat region(40, 50, CV_8UC1, cv::Scalar(0));
  region(cv::Rect(0, 0, 25, 40)).setTo(1);
  cv::imwrite((folder / "region.png").string(), region);
  EXPECT_EQ(segment(background + "--set min_object_px=0 --frames 0 --region " +
                    (folder / "region.png").string())
                .exit_code,
            0);
  EXPECT_EQ(cv::countNonZero(cv::imread((out / "masks/000000.png").string(), 0)), 25);
  EXPECT_EQ(segment(background + "--frames 5").exit_code, 1);
  EXPECT_EQ(segment("--background /no/such.png").exit_code, 1);
  EXPECT_EQ(fivepipe("segment /no/such.mp4 --out " + out.string()).exit_code, 1);
  EXPECT_EQ(fivepipe("segment").exit_code, 2);
}

TEST(Command, StudyWhatIfPrintsAndWritesTheLayouts) {
  const test::TestFolder folder;
  const fs::path csv = folder.path / "new/layouts.csv", json = folder.path / "layouts.json";
  const std::string command = "study what-if " + test::kKeptRecording + " --part block ";
  const Answer answer = fivepipe(command + "--axis -z --at 10cm --range 10cm:300mm --layouts 3 " +
                                 "--csv " + csv.string() + " --json " + json.string());
  ASSERT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "spacing 10.0 cm to 30.0 cm")) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "Minimum spacing above which all are free: "))
      << answer.text;
  EXPECT_TRUE(test::contains(test::text_of(csv), "\nblock,0.2,")) << test::text_of(csv);
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(json))["parts"][0]["layouts"].size(), 3u);
  const auto expect_usage = [&](const std::string& arguments, const std::string& text) {
    const Answer wrong = fivepipe(arguments);
    EXPECT_EQ(wrong.exit_code, 2) << arguments << '\n' << wrong.text;
    EXPECT_TRUE(test::contains(wrong.text, text)) << arguments << '\n' << wrong.text;
  };
  expect_usage(command + "--range 10cm", "--range: write FROM:TO");
  expect_usage(command + "--range 10cm:5cm", "--range: 10cm:5cm begins after its end");
  expect_usage(command + "--range 10:20cm", "'10' is no length; write a number and its unit");
  expect_usage(command + "--range 0m:600m", "--range: '600m' is longer than 500 m");
  expect_usage(command + "--range 0m:1m --axis up", "--axis: 'up' is none of x, y, z");
  expect_usage(command + "--range 0m:1m --axis 0,0,0", "--axis: '0,0,0' is none of");
  expect_usage(command + "--range 0m:1m --at 5", "--at: '5' is no length");
  expect_usage(command + "--range 0m:1m --layouts 0", "--layouts");
  expect_usage(command + "--range 0m:1m --set rig", "expected KEY=VALUE, got 'rig'");
  expect_usage("study what-if " + test::kKeptRecording, "--part or --layout-file is required");
  expect_usage(command + "--range 0m:1m --part plate --axis x --axis y",
               "--axis: twice for the part");
  expect_usage("study what-if " + test::kKeptRecording + " --part crate --range 0m:1m",
               "has no part 'crate'; it has: plate, block");
  expect_usage("study", "");
  expect_usage("study space 18cm", "--deployment is required");
  expect_usage("study space 18cm --deployment " + test::kSmallDeployment,
               "no object of scene demo can be moved: add `spacing` to one in ");
  EXPECT_EQ(fivepipe("study what-if /no/such.mcap --part block --range 0m:1m").exit_code, 1);
}

// Several parts, one that was not there, and a file of layouts.
TEST(Command, StudyWhatIfTakesSeveralPartsAndAFileOfLayouts) {
  const test::TestFolder folder;
  const std::string obj = (folder.path / "bracket.obj").string(),
                    csv = (folder.path / "layouts.csv").string(),
                    results = (folder.path / "results.csv").string(),
                    command = "study what-if " + test::kKeptRecording;
  std::ofstream(obj) << "v 0 0 0\nv 100 0 0\nv 0 0 100\nf 1 2 3\n";
  const std::string bracket = " --part bracket --mesh " + obj + ",mm --position 0m,1cm,-20mm ";
  const Answer parts =
      fivepipe(command + " --part block --axis -z --range 0cm:10cm --layouts 40" + bracket);
  ASSERT_EQ(parts.exit_code, 0) << parts.text;
  for (const char* text : {"Part block, spacing 0.0 cm to 10.0 cm", "10.00 cm",
                           "30 of 40 layouts are shown; --csv FILE writes all.",
                           "Part bracket, which was not in the recording, 10.0 x 0.0 x 10.0 cm"})
    EXPECT_TRUE(test::contains(parts.text, text)) << text << '\n' << parts.text;
  std::ofstream(csv) << "block.x,bracket.z\n0cm,0cm\n1m,5cm\n";
  const Answer table =
      fivepipe(command + bracket + "--layout-file " + csv + " --verdicts --csv " + results);
  ASSERT_EQ(table.exit_code, 0) << table.text;
  EXPECT_TRUE(test::contains(table.text, "of 2 layouts.")) << table.text;
  EXPECT_TRUE(test::contains(test::text_of(results), "\n3,1,0.05,")) << test::text_of(results);
  std::ofstream(csv, std::ios::app) << "2cm\n";
  const Answer wrong = fivepipe(command + bracket + "--layout-file " + csv);
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(test::contains(wrong.text, csv + ":4:1: 1 cells, but 2 columns")) << wrong.text;
}

TEST(Command, StudyRegisterAlignsAPartWithTouchedPoints) {
  const test::TestFolder folder;
  const std::string study = (folder.path / "study").string();
  ASSERT_EQ(fivepipe("study new " + study + " --deployment " + test::kSmallDeployment).exit_code,
            0);
  const std::string command = "study register " + study + " --part side_block ";
  // Turned by 90 degrees about z, and moved by 10, 20 and 5 cm.
  const std::string pairs =
      "--pair 0cm,0cm,0cm=10cm,20cm,5cm --pair 6cm,0cm,0cm=10cm,26cm,5cm "
      "--pair 0cm,8cm,0cm=2cm,20cm,5cm --pair 0cm,0cm,10cm=10cm,20cm,15.4cm ";
  const Answer shown = fivepipe(command + pairs + "--show");
  EXPECT_EQ(shown.exit_code, 0) << shown.text;
  EXPECT_TRUE(test::contains(shown.text, "RMS ")) << shown.text;
  EXPECT_FALSE(test::contains(shown.text, "is changed")) << shown.text;
  const Answer answer = fivepipe(command + pairs);
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "scene.yaml is changed")) << answer.text;
  const Answer wrong = fivepipe(command + "--pair 1,2,3=4,5,6");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_TRUE(test::contains(wrong.text, "is not X,Y,Z=X,Y,Z with units")) << wrong.text;
  const Answer few = fivepipe(command + "--pair 0m,0m,0m=1m,1m,1m");
  EXPECT_EQ(few.exit_code, 2);
  EXPECT_TRUE(test::contains(few.text, "three or more pairs")) << few.text;
  EXPECT_EQ(fivepipe("study register " + study + " --part absent " + pairs).exit_code, 2);
  EXPECT_EQ(fivepipe("study list /no/such/study").exit_code, 2);
  // Meshes replace the scene's objects.
  const fs::path mesh = folder.path / "part.obj";
  std::ofstream(mesh) << "v 0 0 0\nv 100 0 0\nv 0 200 0\nv 0 0 50\n"
                         "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const std::string from_mesh = "study new " + study + "2 --deployment " + test::kSmallDeployment +
                                " --mesh bracket=" + mesh.string() + ",mm --move bracket,z,";
  const Answer made = fivepipe(from_mesh + "18cm,10cm,34cm");
  EXPECT_EQ(made.exit_code, 0) << made.text;
  EXPECT_TRUE(test::contains(made.text, "10.0 x 20.0 x 5.0 cm, moves along 0,0,1: 18.0 cm"))
      << made.text;
  const Answer no_unit = fivepipe(from_mesh + "18,10cm,34cm");
  EXPECT_EQ(no_unit.exit_code, 2);
  EXPECT_TRUE(test::contains(no_unit.text, "is not NAME,AXIS,AT,FROM,TO")) << no_unit.text;
}

// The file of the plate, 60 x 40 x 20 mm, states its unit.
const std::string kStepFile = FIVEPIPE_SOURCE_DIR "/tests/config/step/plate_with_hole.step";

TEST(Command, StudyNewReadsStepFiles) {
  if (!base::exists(config::kStepModule))
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("built without Open CASCADE (libocct-data-exchange-dev)");
  const test::TestFolder folder;
  const std::string study = (folder.path / "study").string();
  const fs::path part = folder.path / "PLATE.STP";
  fs::copy_file(kStepFile, part);
  const auto made_of = [&](const std::string& mesh) {
    return fivepipe("study new " + study + " --deployment " + test::kSmallDeployment +
                    " --mesh plate=" + mesh + " --move plate,z,18cm,10cm,34cm");
  };
  const Answer wrong_unit = made_of(part.string() + ",in");
  EXPECT_EQ(wrong_unit.exit_code, 2) << wrong_unit.text;
  EXPECT_TRUE(test::contains(wrong_unit.text,
                             "the file's unit is 1 mm, not 25.4 mm: leave the "
                             "unit out"))
      << wrong_unit.text;
  const Answer made = made_of(part.string());
  EXPECT_EQ(made.exit_code, 0) << made.text;
  EXPECT_TRUE(test::contains(made.text, "6.0 x 4.0 x 2.0 cm, moves along 0,0,1: 18.0 cm"))
      << made.text;
  EXPECT_FALSE(test::contains(made.text, "STEP")) << "text of the library: " << made.text;
  // The study has a copy.
  fs::remove(part);
  EXPECT_EQ(fivepipe("study list " + study).exit_code, 0);
  const Answer what_if = fivepipe("study what-if " + test::kKeptRecording +
                                  " --part cover --mesh " + kStepFile + " --position 0m,1cm,-20mm");
  EXPECT_EQ(what_if.exit_code, 0) << what_if.text;
  EXPECT_TRUE(test::contains(what_if.text, "not in the recording, 6.0 x 4.0 x 2.0 cm"))
      << what_if.text;
}

// The module is beside the program, so a copy of the program elsewhere has none.
TEST(Command, AStepFileWithoutTheModuleNamesThePackages) {
  const test::TestFolder folder;
  const fs::path program = folder.path / "fivepipe_study";
  fs::copy_file(FIVEPIPE_BINARY_DIR "/fivepipe_study", program);
  const Answer answer =
      answer_of(program.string() + " new " + (folder.path / "study").string() + " --deployment " +
                test::kSmallDeployment + " --mesh plate=" + kStepFile);
  EXPECT_EQ(answer.exit_code, 2) << answer.text;
  EXPECT_TRUE(test::contains(answer.text,
                             "this build has no Open CASCADE: install libocct-data-exchange-dev "
                             "and build again; with the Debian package fivepipe, install "
                             "fivepipe-step instead"))
      << answer.text;
}

TEST(Command, ExportWritesTheFilesAndPrintsTheExcess) {
  const test::TestFolder folder;
  const fs::path out = folder.path / "new/files";
  const std::string command = "export " + test::kKeptRecording + " --out " + out.string() + ' ';
  const auto expect_usage = [&](const std::string& options, const std::string& text) {
    const Answer wrong = fivepipe(command + options);
    EXPECT_EQ(wrong.exit_code, 2) << options << '\n' << wrong.text;
    EXPECT_TRUE(test::contains(wrong.text, text)) << options << '\n' << wrong.text;
    EXPECT_FALSE(fs::exists(out));
  };
  expect_usage("", "nothing to export");
  expect_usage("--meshes fbx", "--meshes");
  expect_usage("--points stl", "--points");
  expect_usage("--volumes --cell 4", "--cell: '4' is no length; write a number and its unit");
  expect_usage("--volumes --cell 2m", "--cell: '2m' is not between 0.1mm and 1m");
  expect_usage("--swept glb --swept-cell 0.01mm", "--swept-cell: '0.01mm' is not between");
  expect_usage("--volumes --every 0", "--every");
  expect_usage("--depth png --view ceiling", "--view: the rig has no camera 'ceiling'");
  expect_usage("--volumes --start 2 --end 1", "--start is after --end");
  expect_usage("--volumes --set rig", "--set: expected KEY=VALUE, got rig");
  const Answer answer = fivepipe(command +
                                 "--meshes glb --depth exr --swept stl --every 11 --cell 1cm "
                                 "--swept-cell 10mm --start 0.5 --end 1.5 --threads 1");
  ASSERT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "\n2 of ")) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "The hulls themselves sweep ")) << answer.text;
  EXPECT_GT(fs::file_size(out / "swept.stl"), 10'000u);
  EXPECT_EQ(test::line_count(test::text_of(out / "frames.csv")), 3);
  for (const char* part : {"meshes", "depth"})
    EXPECT_GE(std::distance(fs::directory_iterator(out / part), fs::directory_iterator()), 2);
  const Answer again = fivepipe(command + "--volumes");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_TRUE(test::contains(again.text, "is not empty; choose another folder")) << again.text;
  EXPECT_EQ(fivepipe("export /no/such.mcap --volumes --out " + (out / "x").string()).exit_code, 1);
}

TEST(Command, ExportWritesTheComposites) {
  const test::TestFolder folder;
  const fs::path out = folder.path / "files";
  const std::string command = "export " + test::kKeptRecording + " --composites --out ";
  const Answer answer = fivepipe(command + out.string() + " --start 0.5 --end 1.5");
  ASSERT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "composited frames in composite.mp4")) << answer.text;
  EXPECT_GT(fs::file_size(out / "composites/composite.mp4"), 1000u);
  const cv::Mat image = cv::imread((out / "composites/composite.png").string());
  EXPECT_EQ(image.size(), cv::Size(160, 120));
  EXPECT_FALSE(fs::exists(out / "frames.csv"));
  // No message is in the range.
  EXPECT_EQ(fivepipe(command + (folder.path / "none").string() + " --start 100").exit_code, 2);
  EXPECT_FALSE(fs::exists(folder.path / "none"));
}

TEST(Command, ErrorsOfMapsHaveTheirExitCode) {
  const PicturesDeployment pictures;
  const auto expect = [&](const std::string& arguments, int exit_code, const std::string& text) {
    const Answer answer = pictures.maps(arguments);
    EXPECT_EQ(answer.exit_code, exit_code) << arguments << '\n' << answer.text;
    EXPECT_TRUE(test::contains(answer.text, text)) << text << '\n' << answer.text;
  };
  expect("--frame -1", 2, "--frame");
  expect("--set data", 2, "expected KEY=VALUE, got data");
  EXPECT_EQ(
      fivepipe("maps --set data=" + pictures.folder.string() + "/ " +
               (pictures.folder / "deployment.yaml").string() + " --out " + pictures.out.string())
          .exit_code,
      0)
      << "--set takes one word";
  expect("--set data=a=b", 2, "a=bf%d.ppm: no picture has such a name");
  pictures.write_deployment("render_node", "");
  expect("", 1,
         (pictures.folder / "deployment.yaml").string() + ": the deployment has no capture_node");
  const std::string others =
      ", above: {video: f%d.ppm, background: empty.ppm}, "
      "right: {video: f%d.ppm, background: empty.ppm}";
  pictures.write_deployment("capture_node", "left: {v4l2: /dev/no_camera}" + others);
  expect("", 3, "fivepipe maps: left: /dev/no_camera: no such camera");
  pictures.write_deployment("capture_node",
                            "left: {video: f%d.ppm, background: empty.ppm}" + others);
  fs::create_directories(pictures.out);
  fs::remove(pictures.out / "cameras.txt");
  fs::create_symlink("/dev/full", pictures.out / "cameras.txt");
  expect("", 1, (pictures.out / "cameras.txt").string() + ": cannot be written");
}

// A machine of the tests has no camera, that of a developer may have some.
TEST(Command, CamerasAreListedAlsoIfThereIsNone) {
  const Answer answer = fivepipe("cameras");
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(
      std::regex_search(answer.text, std::regex("^(no camera is connected|v4l2: .|genicam: .)")))
      << answer.text;
  const Answer json = fivepipe("cameras --json");
  EXPECT_EQ(json.exit_code, 0) << json.text;
  EXPECT_TRUE(std::regex_search(json.text, std::regex("\"cameras\": \\["))) << json.text;
  EXPECT_EQ(fivepipe("cameras --surely-not").exit_code, 2);
  EXPECT_NE(fivepipe("cameras --help").text.find("--json"), std::string::npos);
}

TEST(Command, VersionIsOneLine) {
  const Answer answer = fivepipe("--version");
  EXPECT_EQ(answer.exit_code, 0);
  EXPECT_EQ(answer.text.rfind("fivepipe 0.", 0), 0u) << answer.text;
  EXPECT_TRUE(answer.text.ends_with(std::string(", ") + base::build_type() + ")\n")) << answer.text;
  EXPECT_EQ(answer.text.find('\n'), answer.text.size() - 1);
}

TEST(Command, TopReportsThatTheLargestDomainIsSilent) {
  const Answer answer = fivepipe("top --once --domain 230");
  EXPECT_EQ(answer.exit_code, 3) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "no node publishes a status in domain 230"))
      << answer.text;
}

TEST(Command, DoctorFindsThisMachineReady) {
  const Answer answer = fivepipe("doctor --domain 198");
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  for (const char* part :
       {"build:", "GL:", "receive buffers", "loopback", "DDS", "cores", "disk", "camera"})
    EXPECT_TRUE(test::contains(answer.text, part)) << part << " is not in\n" << answer.text;
  const std::string build = base::build_type();
  EXPECT_EQ(answer.text.rfind(build == "Release" ? "ok    build: Release\n"
                                                 : "warn  build: " + build + ", many times",
                              0),
            0u)
      << answer.text;
  // A container with its own network namespace lacks the file.
  std::string rmem_max = test::text_of("/proc/sys/net/core/rmem_max");
  if (rmem_max.empty()) rmem_max = "0";
  EXPECT_TRUE(test::contains(answer.text, " kernel receive buffers: up to " +
                                              rmem_max.substr(0, rmem_max.find('\n')) + " bytes\n"))
      << answer.text;
  const bool is_software = test::contains(answer.text, "GL: llvmpipe");
  EXPECT_EQ(test::contains(answer.text, "warn  GL:"), is_software) << answer.text;
  EXPECT_TRUE(test::contains(answer.text, "ok    loopback interface: up\n")) << answer.text;
  EXPECT_TRUE(
      test::contains(answer.text, "ok    DDS: participant in domain 198 with profile loopback\n"))
      << answer.text;
  std::istringstream lines(answer.text);
  int findings = 0, warnings = 0, advice = 0;
  std::string last;
  for (std::string line; std::getline(lines, line); last = line) {
    findings += line.starts_with("ok    ");
    warnings += line.starts_with("warn  ");
    advice += line.starts_with("      -> ");
  }
  EXPECT_GE(findings + warnings, 8) << answer.text;
  EXPECT_EQ(advice, warnings) << answer.text;
  EXPECT_TRUE(last.starts_with("fivepipe 0.")) << last;
  EXPECT_TRUE(last.ends_with("): 0 failed, " + std::to_string(warnings) + " warnings")) << last;
  EXPECT_TRUE(
      test::contains(answer.text, (base::core_count() < 5 ? "warn  cores: " : "ok    cores: ") +
                                      std::to_string(base::core_count()) + ", "))
      << answer.text;
  const double free_gb = double(fs::space(".").available) / 1e9;
  if (free_gb > 1.1 || free_gb < 0.9) {
    EXPECT_TRUE(test::contains(answer.text, free_gb > 1 ? "ok    disk: " : "warn  disk: "));
  }
  const std::size_t disk = answer.text.find(" disk: ") + 7;
  EXPECT_NEAR(std::stod(answer.text.substr(disk)), free_gb, 2) << "other programs write, too";
}

// __EGL_VENDOR_LIBRARY_FILENAMES=/dev/null leaves libglvnd without a driver. A libEGL that is a
// driver itself ignores the variable.
bool egl_can_be_disabled() {
  return dlopen("libEGL.so.1", RTLD_LAZY) == nullptr ||
         dlopen("libGLdispatch.so.0", RTLD_LAZY | RTLD_NOLOAD) != nullptr;
}

TEST(Command, DoctorStatesWhatFailsAndHowToFixIt) {
  const Answer answer = answer_of(
      "__EGL_VENDOR_LIBRARY_FILENAMES=/dev/null "
      "CYCLONEDDS_URI='<CycloneDDS><Wrong/></CycloneDDS>' " FIVEPIPE_BINARY_DIR
      "/fivepipe doctor --domain 198");
  EXPECT_EQ(answer.exit_code, 3) << answer.text;
  std::vector<std::string> parts = {"\nFAIL  DDS: ",
                                    "\n      -> check the network profile and CYCLONEDDS_URI\n"};
  if (egl_can_be_disabled())
    parts.insert(parts.end(), {"\nFAIL  GL: ", "\n      -> install EGL: ", "): 2 failed, "});
  for (const std::string& part : parts)
    EXPECT_TRUE(test::contains(answer.text, part)) << part << " is not in\n" << answer.text;
}

// A folder with a copy of `fivepipe`, which finds its other programs there.
class CommandWithPrograms : public testing::Test {
 protected:
  CommandWithPrograms() {
    fs::copy_file(FIVEPIPE_BINARY_DIR "/fivepipe", folder_ / "fivepipe");
    for (const char* program : {"fivepipe_bench_b", "fivepipe_bench_a", "fivepipe_measure"})
      write(program);
    fs::create_directory(folder_ / "fivepipe_bench_folder");
  }
  void write(const std::string& program, fs::perms permissions = fs::perms::owner_all) {
    std::ofstream(folder_ / program) << "#!/bin/sh\necho " + program + " \"$@\"\nexit 7\n";
    fs::permissions(folder_ / program, permissions);
  }
  Answer run(const std::string& arguments) {
    return answer_of((folder_ / "fivepipe").string() + " " + arguments);
  }
  const test::TestFolder test_folder_;
  const fs::path folder_ = test_folder_.path;
};

TEST_F(CommandWithPrograms, BenchStartsASuiteOrTheBenchmarkOfANode) {
  for (const char* suite : {"a", "b --json x", "a --help", "b -h"}) {
    const Answer answer = run("bench " + std::string(suite));
    EXPECT_EQ(answer.exit_code, 7) << suite;
    EXPECT_EQ(answer.text, std::string("fivepipe_bench_") + suite[0] + &suite[1] + "\n");
  }
  for (const char* measured :
       {"compare x y", "pipeline", "any_node", "name --from f", "name --from=f", "a --from f",
        "name --help", "name -h", "name --x --help"}) {
    const Answer answer = run("bench " + std::string(measured));
    EXPECT_EQ(answer.exit_code, 7) << measured << answer.text;
    EXPECT_EQ(answer.text, std::string("fivepipe_measure ") + measured + "\n");
  }
}

TEST_F(CommandWithPrograms, BenchListsTheSuitesIfItKnowsNoneOfThatName) {
  const std::string list =
      "  from a recording: NODE --from FILE.mcap, pipeline --from FILE.mcap\n"
      "  results: compare BEFORE AFTER\n";
  EXPECT_EQ(run("bench").text, "bench: name a benchmark\n  suites: a, b\n" + list);
  const Answer unknown = run("bench c");
  EXPECT_EQ(unknown.text, "bench: no benchmark 'c'\n  suites: a, b\n" + list);
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_EQ(run("bench folder").exit_code, 2);
  for (const char* program : {"fivepipe_bench_a", "fivepipe_bench_b"})
    fs::remove(folder_ / program);
  EXPECT_EQ(run("bench a").text, "bench: no benchmark 'a'\n  suites: none in " + folder_.string() +
                                     "; an installation has none: build the source tree by "
                                     "launch/build, and run build/release/bin/fivepipe bench\n" +
                                     list);
}

TEST_F(CommandWithPrograms, AProgramThatIsMissingOrCannotBeStartedIsNamed) {
  const std::string maps = (folder_ / "fivepipe_maps").string();
  const Answer missing = run("maps a.yaml");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_EQ(missing.text, maps + " is not built; run launch/build --target fivepipe_maps\n");
  write("fivepipe_maps", fs::perms::owner_read);
  const Answer refused = run("maps a.yaml");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(std::regex_match(
      refused.text,
      std::regex("\\d\\d:\\d\\d:\\d\\d\\.\\d\\d\\d critical " + maps + ": Permission denied\n")))
      << refused.text;
  EXPECT_EQ(answer_of("(" + (folder_ / "fivepipe").string() + " maps a.yaml 2>/dev/null)").text, "")
      << "logged on stderr";
  fs::remove(maps);
  write("fivepipe_maps");
  EXPECT_EQ(run("maps a.yaml --help").text, "fivepipe_maps a.yaml --help\n");
}

}  // namespace
}  // namespace fivepipe::launch
