// fivepipe_footage: writes the images of a deployment's synthetic cameras to files, as cameras
// would deliver them, so that `fivepipe bench pipeline` can measure capture_node with its decoding.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "capture_node/sources/synthetic_source.h"
#include "common/config/deployment.h"

namespace fivepipe::footage {
namespace {

// The quality at which USB cameras compress: artefacts stay below the synthetic sensor noise.
constexpr int kJpegQuality = 95;
constexpr int kBackgroundImages = 24;

struct Options {
  std::filesystem::path deployment, out;
  int frames = 120;
};

void write(const std::filesystem::path& file, const cv::Mat& bgr) {
  if (!cv::imwrite(file.string(), bgr, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality}))
    throw std::runtime_error(file.string() + ": cannot be written");
}

int run(const Options& options) {
  const config::Deployment deployment = config::load_deployment(options.deployment, {});
  const config::CaptureConfig capture = config::capture_of_all_nodes(deployment);
  const auto surroundings = std::make_shared<const capture::Surroundings>(capture.synthetic.seed);
  for (const config::RigCamera& camera : deployment.rig.cameras) {
    const auto source = capture.sources.find(camera.name);
    if (source == capture.sources.end() ||
        !std::holds_alternative<config::SyntheticSource>(source->second))
      continue;
    capture::SyntheticImageSource images(
        capture.synthetic, camera, deployment.frame_rate_hz,
        [&](double t_s) { return config::eye_from_world_at(deployment.viewer, t_s); },
        surroundings);
    const std::filesystem::path folder = options.out / camera.name;
    std::filesystem::create_directories(folder);
    cv::Mat bgr;
    for (int frame = 0; frame < options.frames; ++frame) {
      images.read(frame, bgr);
      write(folder / fmt::format("{:04}.jpg", frame), bgr);
    }
    // A camera on the viewer has no empty scene; the configuration still names a file.
    for (int i = 0; i < kBackgroundImages; ++i)
      write(folder / fmt::format("background_{:02}.jpg", i),
            camera.mount == config::Mount::world ? images.background(i) : bgr);
    std::cout << camera.name << ": " << options.frames << " images" << std::endl;
  }
  return 0;
}

}  // namespace
}  // namespace fivepipe::footage

int main(int argc, char** argv) {
  fivepipe::footage::Options options;
  CLI::App app(
      "fivepipe_footage: writes the images of a deployment's synthetic cameras to "
      "FOLDER/CAMERA/0000.jpg and so on, and images of the empty scene to "
      "FOLDER/CAMERA/background_00.jpg and so on.\n\n"
      "Example:\n  build/release/bin/fivepipe_footage launch/deployments/paper.yaml --out "
      "out/footage\n\n"
      "Exit codes: 0 written, 1 a file cannot be written, 2 usage or configuration.");
  app.add_option("deployment", options.deployment, "deployment file")->required();
  app.add_option("--out", options.out, "output folder")->required();
  app.add_option("--frames", options.frames, "number of frames")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    return fivepipe::footage::run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const fivepipe::config::ConfigError& error) {
    return std::cerr << error.what() << '\n', 2;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe_footage: " << error.what() << '\n', 1;
  }
}
