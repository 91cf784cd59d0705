// fivepipe maps: writes the object-pixel maps of frames of a deployment to files, for inspection
// and for `fivepipe bench hull --maps`.
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "capture_node/capture.h"
#include "capture_node/frame_range.h"
#include "capture_node/overlay.h"
#include "common/config/deployment.h"
#include "common/hull/cpu/has_hull.h"
#include "common/hull/pbm.h"

namespace fivepipe::capture {
namespace {

struct Options {
  std::filesystem::path deployment, out;
  std::vector<std::string> settings;
  std::string frames = "0";
  bool overlays = false;
};

std::map<std::string, std::string> settings_from(const std::vector<std::string>& words) {
  std::map<std::string, std::string> settings;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
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

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

// ", camera at (1.20, -0.55, 2.05) m".
std::string position_text(const config::Deployment& deployment, const std::string& name) {
  for (const config::RigCamera& camera : deployment.rig.cameras)
    if (camera.name == name) {
      const Eigen::Vector3d at_m =
          geometry::camera_center_world_m(config::published_camera(camera));
      return fmt::format(", camera at ({:.2f}, {:.2f}, {:.2f}) m", at_m.x(), at_m.y(), at_m.z());
    }
  return "";
}

// Writes the maps of one frame, the cameras and the volume. Prints the fraction of object pixels of
// each camera, after `prefix`.
void write_frame(const config::Deployment& deployment, const std::vector<CapturedCamera>& captured,
                 std::int64_t frame, const std::filesystem::path& folder,
                 const std::string& prefix) {
  std::string cameras = fmt::format(
      "# name width height fx fy cx cy [px], three rows of camera_from_world [m]: {}, frame {}\n",
      deployment.name, frame);
  int written = 0;
  for (const CapturedCamera& of_camera : captured) {
    if (!of_camera.pixels) continue;
    const hull::ObjectPixels& pixels = *of_camera.pixels;
    hull::write_pbm(folder / (of_camera.camera + ".pbm"), pixels);
    for (const config::RigCamera& camera : deployment.rig.cameras) {
      if (camera.name != of_camera.camera) continue;
      if (camera.mount != config::Mount::world)
        throw std::runtime_error("camera " + camera.name +
                                 " is mounted on the viewer and has no fixed pose");
      cameras += camera_line(camera) + '\n';
      ++written;
    }
    const double fraction =
        double(pixels.count()) / (double(pixels.width_px()) * pixels.height_px());
    std::cout << fmt::format("{}{}: {:.1f} % object pixels{}\n", prefix, of_camera.camera,
                             100 * fraction, position_text(deployment, of_camera.camera));
  }
  if (written == 0) throw std::runtime_error("no capture_node has a camera that gives shape");
  write_text(folder / "cameras.txt", cameras);
  const Eigen::AlignedBox3d& volume_m = deployment.rig.volume_m;
  write_text(folder / "volume.txt",
             fmt::format("# volume_m of the rig: min, max [m]\n{:.17g} {:.17g}\n",
                         fmt::join(volume_m.min().data(), volume_m.min().data() + 3, " "),
                         fmt::join(volume_m.max().data(), volume_m.max().data() + 3, " ")));
}

// States that the silhouettes have no common point, and without which cameras they have one; empty
// if they have one, if a camera has no object pixels, and with hull limits `seen`, for which a
// common point is not needed.
std::string common_point_text(const config::Deployment& deployment,
                              const std::vector<CapturedCamera>& captured) {
  std::vector<hull::Silhouette> all;
  std::vector<std::string> names;
  for (const CapturedCamera& of_camera : captured)
    for (const config::RigCamera& camera : deployment.rig.cameras)
      if (camera.name == of_camera.camera && of_camera.pixels && of_camera.pixels->count() > 0) {
        all.push_back({config::published_camera(camera), *of_camera.pixels});
        names.push_back(camera.name);
      }
  if (deployment.hull_rule.limits != hull::Limits::all ||
      all.size() < config::shape_cameras(deployment.rig).size())
    return "";
  base::WorkerPool pool(1);
  hull::CpuHull hull(pool);
  const auto has_hull_without = [&](const std::set<std::size_t>& left_out) {
    std::vector<hull::Silhouette> some;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (!left_out.contains(i)) some.push_back(all[i]);
    hull.assign(some, deployment.hull_rule);
    return hull::has_hull(hull, some);
  };
  if (has_hull_without({})) return "";
  std::string text = std::string("no hull: ") + hull::kNoCommonPoint + '\n';
  // Two cameras nearly always have a common point.
  constexpr std::size_t kMinCameras = 3;
  const std::size_t before = text.size();
  for (std::size_t i = 0; i < all.size() && all.size() > kMinCameras; ++i)
    if (has_hull_without({i})) text += "there is a hull without " + names[i] + '\n';
  for (std::size_t i = 0; i < all.size() && text.size() == before; ++i)
    for (std::size_t j = i + 1; j < all.size() && all.size() > kMinCameras + 1; ++j)
      if (has_hull_without({i, j}))
        text += "there is a hull without " + names[i] + " and " + names[j] + '\n';
  return text;
}

int run(const Options& options) {
  const auto range = parse_frame_range(options.frames);
  if (!range)
    throw CLI::ValidationError("--frames", "expected N, A:B or A:B:STEP, got " + options.frames);
  const config::Deployment deployment =
      config::load_deployment(options.deployment, settings_from(options.settings));
  Capture capture(deployment.rig, deployment.viewer,
                  config::without_clock(config::capture_of_all_nodes(deployment)),
                  deployment.frame_rate_hz, [](std::string_view what, double fraction) {
                    std::fprintf(stderr, "\r%.*s, %d %%   ", int(what.size()), what.data(),
                                 int(100 * fraction));
                  });
  std::fputs("\n", stderr);
  std::mutex mutex;
  std::map<std::string, cv::Mat> overlays;  // by camera
  if (options.overlays)
    capture.set_observer([&](const config::RigCamera& camera, const cv::Mat& image,
                             const Segmentation& segmentation) {
      cv::Mat picture = overlay(image, segmentation);
      if (camera.mount == config::Mount::world)
        draw_volume(picture, camera, deployment.rig.volume_m);
      const std::lock_guard lock(mutex);
      overlays[camera.name] = std::move(picture);
    });
  for (std::int64_t frame = range->first; frame <= range->last; frame += range->step) {
    const std::vector<CapturedCamera> captured = capture.capture(frame, false);
    for (const CapturedCamera& of_camera : captured)
      if (of_camera.status != CaptureStatus::captured)
        throw std::runtime_error("camera " + of_camera.camera + ": no image of frame " +
                                 std::to_string(frame) + ": " + of_camera.reason);
    const bool is_single = range->first == range->last;
    const std::filesystem::path folder =
        is_single ? options.out : options.out / fmt::format("frame_{:06}", frame);
    std::filesystem::create_directories(folder);
    write_frame(deployment, captured, frame, folder,
                is_single ? "" : fmt::format("frame {}, ", frame));
    std::cout << common_point_text(deployment, captured);
    for (const auto& [camera, picture] : overlays)
      if (const auto file = folder / (camera + "_overlay.png");
          !cv::imwrite(file.string(), picture))
        throw std::runtime_error(file.string() + ": cannot be written");
  }
  return 0;
}

}  // namespace
}  // namespace fivepipe::capture

int main(int argc, char** argv) {
  fivepipe::capture::Options options;
  CLI::App app(
      "fivepipe maps: writes the object-pixel maps of a frame to FOLDER/CAMERA.pbm, the cameras "
      "to FOLDER/cameras.txt and the rig's volume to FOLDER/volume.txt.\n\n"
      "Example:\n  fivepipe maps launch/deployments/seated4cam.yaml --set "
      "data=recordings/seated4cam --frame 60 --overlays --out out/maps/seated4cam\n\n"
      "Exit codes: 0 written, 1 no image of this frame, 2 usage or configuration, 3 camera "
      "missing.");
  app.add_option("deployment", options.deployment, "deployment file")->required();
  app.add_option("--out", options.out, "output folder")->required();
  app.add_option("--frame,--frames", options.frames,
                 "N, A:B or A:B:STEP, from 0 (default 0). With several frames, each has a folder "
                 "frame_N of its own");
  app.add_flag("--overlays", options.overlays,
               "also writes CAMERA_overlay.png: the captured image with object pixels red, shadow "
               "blue, and yellow what differs but was dropped");
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
