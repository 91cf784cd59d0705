// Writes frames of a shipped scene as PNG files, for a clip of it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/gl/context.h"
#include "tests/scenes/scene_player.h"

namespace fivepipe::test {
namespace {

struct ClipOptions {
  std::string name;
  std::filesystem::path folder;
  double start_s = 0, duration_s = 4, rate_hz = 12;
  int width_px = 480;
};

// Number of the deployment's frames from one frame of the clip to the next.
std::int64_t step_frames(double frame_rate_hz, double rate_hz) {
  // Relative rounding error of a quotient that is a whole number.
  constexpr double kRounding = 1e-9;
  const double step = std::round(frame_rate_hz / rate_hz);
  if (!(step >= 1 && std::abs(step * rate_hz - frame_rate_hz) <= kRounding * frame_rate_hz))
    throw std::invalid_argument(fmt::format("--rate {} does not divide the {} Hz of the deployment",
                                            rate_hz, frame_rate_hz));
  return std::int64_t(step);
}

void write_frames(const ClipOptions& options) {
  const config::Deployment deployment = shipped_deployment(options.name);
  const double rate_hz = deployment.frame_rate_hz;
  const std::int64_t step = step_frames(rate_hz, options.rate_hz),
                     first = std::llround(options.start_s * rate_hz),
                     end = std::llround((options.start_s + options.duration_s) * rate_hz);
  const gl::GlContext context;
  ScenePlayer player(deployment);
  std::filesystem::create_directories(options.folder);
  std::int64_t next = 0;  // frame of the deployment
  int written = 0;
  for (std::int64_t frame = first; frame < end; frame += step) {
    player.simulate(next, frame);
    next = frame + 1;
    const cv::Mat image = player.composite_of_images();
    cv::Mat small;
    cv::resize(image, small, {options.width_px, options.width_px * image.rows / image.cols}, 0, 0,
               cv::INTER_AREA);
    const std::filesystem::path file = options.folder / fmt::format("{:04}.png", written++);
    if (!cv::imwrite(file, small)) throw std::runtime_error("cannot write " + file.string());
  }
}

}  // namespace
}  // namespace fivepipe::test

int main(int argc, char** argv) {
  fivepipe::test::ClipOptions options;
  CLI::App app("Writes frames of launch/deployments/NAME.yaml to FOLDER/NNNN.png.");
  app.add_option("NAME", options.name)->required();
  app.add_option("--out", options.folder, "folder of the frames")->required();
  app.add_option("--start", options.start_s, "time of the first frame [s]")
      ->check(CLI::Range(0.0, 1e3));
  app.add_option("--duration", options.duration_s, "[s]")->check(CLI::Range(0.01, 1e3));
  app.add_option("--rate", options.rate_hz, "frames per second; divides that of the deployment")
      ->check(CLI::Range(0.1, 1e3));
  app.add_option("--width", options.width_px, "of the frames [px]")->check(CLI::Range(16, 4096));
  CLI11_PARSE(app, argc, argv);
  try {
    fivepipe::test::write_frames(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "scene_clip: {}\n", error.what());
    return 2;
  }
  return 0;
}
