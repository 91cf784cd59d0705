// fivepipe maps: writes the object-pixel maps of one frame of a deployment to files, for inspection
// and for `fivepipe bench hull --maps`.
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "capture_node/capture.h"
#include "common/config/deployment.h"
#include "common/hull/pbm.h"

namespace fivepipe::capture {
namespace {

struct Options {
  std::filesystem::path deployment, out;
  std::vector<std::string> settings;
  std::int64_t frame = 0;
};

std::map<std::string, std::string> settings_from(const std::vector<std::string>& words) {
  std::map<std::string, std::string> settings;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    if (equals == std::string::npos)
      throw CLI::ValidationError("--set", "expected KEY=VALUE, got " + word);
    settings[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return settings;
}

// One line: name, size, intrinsics, and the three rows of camera_from_world.
std::string camera_line(const config::RigCamera& camera) {
  const geometry::Pinhole& k = camera.published;
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> pose =
      camera.camera_from_mount.matrix().topRows<3>();
  return fmt::format("{} {} {} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}", camera.name, k.width_px,
                     k.height_px, k.fx_px, k.fy_px, k.cx_px, k.cy_px,
                     fmt::join(pose.data(), pose.data() + pose.size(), " "));
}

int run(const Options& options) {
  const config::Deployment deployment =
      config::load_deployment(options.deployment, settings_from(options.settings));
  const config::CaptureConfig* found = nullptr;
  for (const config::Node& node : deployment.nodes)
    if (!found) found = std::get_if<config::CaptureConfig>(&node.config);
  if (!found)
    throw std::runtime_error(options.deployment.string() + ": the deployment has no capture_node");
  // A frame beyond the end of a file must not be one of its first frames again.
  config::CaptureConfig config = *found;
  config.loop = false;
  config.precomputed_frames = 0;
  Capture capture(deployment.rig, deployment.viewer, config, deployment.frame_rate_hz,
                  [](std::string_view what, double fraction) {
                    std::fprintf(stderr, "\r%.*s, %d %%   ", int(what.size()), what.data(),
                                 int(100 * fraction));
                  });
  std::fputs("\n", stderr);
  const std::vector<CapturedCamera> cameras_of_frame = capture.capture(options.frame, false);
  for (const CapturedCamera& captured : cameras_of_frame)
    if (captured.status != CaptureStatus::captured)
      throw std::runtime_error("camera " + captured.camera + ": no image of frame " +
                               std::to_string(options.frame) + ": " + captured.reason);
  std::filesystem::create_directories(options.out);
  std::ofstream cameras(options.out / "cameras.txt");
  cameras << "# name width height fx fy cx cy [px], three rows of camera_from_world [m]: "
          << deployment.name << ", frame " << options.frame << '\n';
  int written = 0;
  for (const CapturedCamera& captured : cameras_of_frame) {
    if (!captured.pixels) continue;
    hull::write_pbm(options.out / (captured.camera + ".pbm"), *captured.pixels);
    for (const config::RigCamera& camera : deployment.rig.cameras) {
      if (camera.name != captured.camera) continue;
      if (camera.mount != config::Mount::world)
        throw std::runtime_error("camera " + camera.name +
                                 " is mounted on the viewer and has no fixed pose");
      cameras << camera_line(camera) << '\n';
      ++written;
    }
    const double fraction = double(captured.pixels->count()) /
                            (double(captured.pixels->width_px()) * captured.pixels->height_px());
    std::printf("%s: %.1f %% object pixels\n", captured.camera.c_str(), 100 * fraction);
  }
  if (written == 0) throw std::runtime_error("the capture_node has no camera that gives shape");
  if (!cameras.flush())
    throw std::runtime_error((options.out / "cameras.txt").string() + ": cannot be written");
  const Eigen::AlignedBox3d& volume_m = deployment.rig.volume_m;
  std::ofstream volume(options.out / "volume.txt");
  volume << fmt::format("# volume_m of the rig: min, max [m]\n{:.17g} {:.17g}\n",
                        fmt::join(volume_m.min().data(), volume_m.min().data() + 3, " "),
                        fmt::join(volume_m.max().data(), volume_m.max().data() + 3, " "));
  if (!volume.flush())
    throw std::runtime_error((options.out / "volume.txt").string() + ": cannot be written");
  return 0;
}

}  // namespace
}  // namespace fivepipe::capture

int main(int argc, char** argv) {
  fivepipe::capture::Options options;
  CLI::App app(
      "fivepipe maps: writes the object-pixel maps of one frame to FOLDER/CAMERA.pbm, the cameras "
      "to FOLDER/cameras.txt and the rig's volume to FOLDER/volume.txt.\n\n"
      "Example:\n  fivepipe maps launch/deployments/seated4cam.yaml --set "
      "data=recordings/seated4cam --frame 60 --out out/maps/seated4cam\n\n"
      "Exit codes: 0 written, 1 no image of this frame, 2 usage or configuration, 3 camera "
      "missing.");
  app.add_option("deployment", options.deployment, "deployment file")->required();
  app.add_option("--out", options.out, "output folder")->required();
  app.add_option("--frame", options.frame, "frame number, from 0 (default 0)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--set", options.settings, "KEY=VALUE: overrides a setting of the deployment file")
      ->allow_extra_args(false);
  try {
    app.parse(argc, argv);
    return fivepipe::capture::run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const fivepipe::config::ConfigError& error) {
    return std::cerr << error.what() << '\n', 2;
  } catch (const fivepipe::capture::HardwareMissing& missing) {
    return std::cerr << "fivepipe maps: " << missing.what() << '\n', 3;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe maps: " << error.what() << '\n', 1;
  }
}
