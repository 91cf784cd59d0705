// Runs the built `fivepipe` command.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

struct Answer {
  int exit_code = -1;
  std::string text;  // stdout and stderr
};

Answer fivepipe(const std::string& arguments) {
  Answer answer;
  FILE* pipe = popen((FIVEPIPE_BINARY_DIR "/fivepipe " + arguments + " 2>&1").c_str(), "r");
  if (!pipe) return answer;
  char buffer[4096];
  while (const std::size_t got = fread(buffer, 1, sizeof buffer, pipe))
    answer.text.append(buffer, got);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) answer.exit_code = WEXITSTATUS(status);
  return answer;
}

}  // namespace

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

TEST(Command, MissingDeploymentIsAConfigurationError) {
  const Answer answer = fivepipe("up /no/such/deployment.yaml");
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_NE(answer.text.find("/no/such/deployment.yaml"), std::string::npos) << answer.text;
}

TEST(Command, HelpOfEverySubcommandHasAnExample) {
  for (const char* subcommand :
       {"", "up ", "top ", "record ", "replay ", "info ", "ls ", "echo ", "hz ", "simulation ",
        "doctor ", "bench ", "maps ", "bench simulation ", "bench compare "}) {
    const Answer answer = fivepipe(std::string(subcommand) + "--help");
    EXPECT_EQ(answer.exit_code, 0) << answer.text;
    EXPECT_NE(answer.text.find("Example"), std::string::npos) << subcommand << "\n" << answer.text;
    EXPECT_NE(answer.text.find("fivepipe " + std::string(subcommand)), std::string::npos)
        << answer.text;
  }
}

TEST(Command, MapsOfOneFrameAreImagesAndCameras) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("fivepipe_maps_" + std::to_string(getpid()));
  const Answer answer =
      fivepipe("maps " FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml --frame 30 --out " +
               folder.string());
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
  std::filesystem::remove_all(folder);
  EXPECT_EQ(fivepipe("maps /no/such.yaml --out " + folder.string()).exit_code, 2);
  EXPECT_EQ(fivepipe("maps").exit_code, 2);
}

// A deployment with pictures of 50x40 px: a bright square of 10x5 px in picture k, k rows lower.
class PicturesDeployment {
 public:
  PicturesDeployment() {
    std::filesystem::create_directories(folder);
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
    write_deployment("capture_node",
                     "left: {video: \"${data}f%d.ppm\", background: empty.ppm}, "
                     "above: {video: f%d.ppm, background: empty.ppm}, "
                     "right: {video: f%d.ppm, background: empty.ppm}");
  }
  ~PicturesDeployment() { std::filesystem::remove_all(folder); }
  void write_deployment(const std::string& program, const std::string& sources) const {
    std::ofstream(folder / "deployment.yaml")
        << "name: pictures\nrig: rig.yaml\nscene: scene.yaml\nframe_rate_hz: 24\nviewer:\n"
           "  path: [{t_s: 0, eye_m: [0, -0.8, 0], target_m: [0, 0, 0]}]\n"
           "settings: {data: ./}\nnodes:\n"
           "  - {name: first, program: "
        << program << (sources.empty() ? "" : ", loop: false,\n     sources: {" + sources + "}")
        << "}\n";
  }
  Answer maps(const std::string& arguments) const {
    return fivepipe("maps " + (folder / "deployment.yaml").string() + " --out " + out.string() +
                    " " + arguments);
  }
  static std::string text_of(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
  }

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("fivepipe_end_" + std::to_string(getpid()));
  const std::filesystem::path out = folder / "new" / "maps";
};

TEST(Command, MapsHaveTheObjectPixelsAndTheCamerasOfOneFrame) {
  const PicturesDeployment pictures;
  for (const int frame : {0, 2}) {
    const Answer answer = pictures.maps(frame == 0 ? "" : "--frame 2");
    ASSERT_EQ(answer.exit_code, 0) << answer.text;
    for (const char* line : {"left: 2.5 % object pixels\n", "right: 2.5 % object pixels\n",
                             ": reference image, 33 %", ": reference image, 100 %   \n"})
      EXPECT_NE(answer.text.find(line), std::string::npos) << line << '\n' << answer.text;
    EXPECT_EQ(answer.text.find("above: 2.5"), std::string::npos) << answer.text;
    std::string pixels = "P4\n50 40\n" + std::string(7 * 40, '\0');
    for (int v = 8 + frame; v < 13 + frame; ++v)  // columns 20 to 29
      pixels.replace(pixels.size() - std::size_t(7 * (40 - v)) + 2, 2, "\x0f\xfc");
    EXPECT_EQ(PicturesDeployment::text_of(pictures.out / "left.pbm"), pixels);
    EXPECT_EQ(PicturesDeployment::text_of(pictures.out / "right.pbm"), pixels);
    EXPECT_FALSE(std::filesystem::exists(pictures.out / "above.pbm"));
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

TEST(Command, MapsOfAFrameAfterTheLastAreRefused) {
  const PicturesDeployment pictures;
  EXPECT_EQ(pictures.maps("--frame 2").exit_code, 0);
  const Answer after = pictures.maps("--frame 3");
  EXPECT_EQ(after.exit_code, 1) << after.text;
  EXPECT_NE(after.text.find("has an image of frame 3"), std::string::npos) << after.text;
}

TEST(Command, ErrorsOfMapsHaveTheirExitCode) {
  const PicturesDeployment pictures;
  const auto expect = [&](const std::string& arguments, int exit_code, const std::string& text) {
    const Answer answer = pictures.maps(arguments);
    EXPECT_EQ(answer.exit_code, exit_code) << arguments << '\n' << answer.text;
    EXPECT_NE(answer.text.find(text), std::string::npos) << text << '\n' << answer.text;
  };
  expect("--frame -1", 2, "--frame");
  expect("--set data", 2, "expected KEY=VALUE, got data");
  EXPECT_EQ(
      fivepipe("maps --set data=" + pictures.folder.string() + "/ " +
               (pictures.folder / "deployment.yaml").string() + " --out " + pictures.out.string())
          .exit_code,
      0)
      << "--set takes one word";
  expect("--set data=a=b", 2, "a=bf%d.ppm: there is no such file");
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
  std::filesystem::create_directories(pictures.out);
  std::filesystem::remove(pictures.out / "cameras.txt");
  std::filesystem::create_symlink("/dev/full", pictures.out / "cameras.txt");
  expect("", 1, (pictures.out / "cameras.txt").string() + ": cannot be written");
}

TEST(Command, VersionIsOneLine) {
  const Answer answer = fivepipe("--version");
  EXPECT_EQ(answer.exit_code, 0);
  EXPECT_EQ(answer.text.rfind("fivepipe 0.", 0), 0u) << answer.text;
  EXPECT_EQ(answer.text.find('\n'), answer.text.size() - 1);
}

TEST(Command, TopReportsThatTheLargestDomainIsSilent) {
  const Answer answer = fivepipe("top --once --domain 230");
  EXPECT_EQ(answer.exit_code, 3) << answer.text;
  EXPECT_NE(answer.text.find("no node publishes a status in domain 230"), std::string::npos)
      << answer.text;
}

TEST(Command, DoctorFindsThisMachineReady) {
  const Answer answer = fivepipe("doctor --domain 198");
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  for (const char* part :
       {"build:", "GL:", "receive buffers", "loopback", "DDS", "cores", "disk", "camera"})
    EXPECT_NE(answer.text.find(part), std::string::npos) << part << " is not in\n" << answer.text;
  const bool is_software = answer.text.find("GL: llvmpipe") != std::string::npos;
  EXPECT_EQ(answer.text.find("warn  GL:") != std::string::npos, is_software) << answer.text;
}
