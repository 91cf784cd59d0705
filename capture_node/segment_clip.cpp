// fivepipe segment: segments one clip and writes masks and overlays, to choose settings and to see
// what they do.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "capture_node/frame_range.h"
#include "capture_node/overlay.h"
#include "capture_node/segmentation/segmentation.h"
#include "capture_node/sources/image_source.h"
#include "common/config/segmentation_reader.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

// A sequence with more gaps has numbers that do not count its frames, such as dates.
constexpr int kMaxMissing = 1000;
// Images of a clip per second, for `adaptation_s`: a sequence of pictures states none.
constexpr double kClipRate_hz = 30;

// In the output folder.
constexpr const char* kSettingsFile = "segmentation.yaml";

struct Options {
  fs::path clip, background, region, out;
  int background_frames = 30;
  std::string frames;
  std::vector<std::string> settings;
};

// Writes the settings as the user gave them to a file, which can be copied into a deployment, and
// reads it. Throws ConfigError with the file's lines.
config::SegmentationConfig read_settings(const Options& options) {
  const fs::path file = options.out / kSettingsFile;
  std::ofstream text(file);
  for (const std::string& setting : options.settings) {
    const auto equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw CLI::ValidationError("--set", "expected KEY=VALUE, got " + setting);
    text << setting.substr(0, equals) << ": " << setting.substr(equals + 1) << '\n';
  }
  if (options.settings.empty()) text << "{}  # all settings have their defaults\n";
  text.close();
  if (!text) throw std::runtime_error(file.string() + ": cannot be written");
  config::Problems problems;
  config::YamlMap map = config::YamlMap::load(file, problems);
  for (const char* key : {"volume_m", "regions", "cameras"})
    if (map.has(key))
      map.problem_at(key, fmt::format("{} needs a rig: use fivepipe maps, or --region", key));
  config::CaptureConfig config;
  config::read_segmentation(std::move(map), {}, true, config);
  problems.throw_if_any();
  return config.segmentation;
}

std::vector<cv::Mat> background_images(const Options& options, const config::RigCamera& camera,
                                       ImageSource& clip) {
  if (!options.background.empty()) return read_background(camera, options.background.string());
  std::vector<cv::Mat> images;
  for (int i = 0; i < options.background_frames; ++i)
    if (cv::Mat image; clip.read(i, image) == ReadStatus::image) images.push_back(image);
  if (images.empty()) throw std::runtime_error(options.clip.string() + ": no image can be decoded");
  return images;
}

void write_picture(const fs::path& file, const cv::Mat& picture) {
  if (!cv::imwrite(file.string(), picture))
    throw std::runtime_error(file.string() + ": cannot be written");
}

// Creates the folders of the pictures. Removes those of an earlier run (is_used).
void prepare_output(const fs::path& out, bool is_used) {
  for (const char* const name : {"masks", "overlays"}) {
    fs::create_directories(out / name);
    if (!is_used) continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(out / name)) {
      const std::string frame = entry.path().stem().string();
      if (entry.path().extension() == ".png" &&
          frame.find_first_not_of("0123456789") == std::string::npos)
        fs::remove(entry.path());
    }
  }
}

int run(const Options& options) {
  const auto range = options.frames.empty() ? std::optional(FrameRange{0, kMaxFrame, 1})
                                            : parse_frame_range(options.frames);
  if (!range)
    throw CLI::ValidationError("--frames", "expected N, A:B or A:B:STEP, got " + options.frames);
  const bool is_used = fs::exists(options.out / kSettingsFile);
  fs::create_directories(options.out);
  const config::SegmentationConfig config = read_settings(options);
  config::RigCamera camera;
  camera.name = "clip";
  const cv::Size size = image_size(camera, options.clip.string());
  camera.source = camera.published = geometry::pinhole_from_fov(size.width, size.height, 1);
  const auto clip = open_file_source(camera, {options.clip.string(), {}, 0});
  for (const fs::path& file : {options.background, options.region})
    if (!file.empty())
      if (const cv::Size other = image_size(camera, file.string()); other != size)
        throw std::runtime_error(fmt::format("{} has {}x{} px, the clip {}x{}", file.string(),
                                             other.width, other.height, size.width, size.height));
  std::optional<hull::ObjectPixels> within;
  if (!options.region.empty()) within = read_region(camera, options.region.string());
  const std::vector<cv::Mat> learned = background_images(options, camera, *clip);
  std::cout << fmt::format("{}x{}, background from {} image{}\n", size.width, size.height,
                           learned.size(), learned.size() == 1 ? "" : "s");
  Segmenter segmenter(learn_background(learned, learning_settings(config)), config,
                      std::move(within));
  segmenter.set_period_s(double(range->step) / kClipRate_hz);
  prepare_output(options.out, is_used);
  double least = 1, most = 0;
  std::int64_t count = 0, missing = 0;
  for (std::int64_t frame = range->first; frame <= range->last; frame += range->step) {
    cv::Mat image;
    const ReadStatus status = clip->read(frame, image);
    if (status == ReadStatus::end) break;
    if (status == ReadStatus::missing) {
      std::cerr << '\n' << clip->last_error() << '\n';
      if (++missing == kMaxMissing)
        throw std::runtime_error(fmt::format("{} images are missing", missing));
      continue;
    }
    const Segmentation found = segmenter.segment(image).value();
    const std::string name = fmt::format("{:06}.png", frame);
    write_picture(options.out / "masks" / name, mask_image(found.object));
    write_picture(options.out / "overlays" / name, overlay(image, found));
    const double fraction = double(found.object.count()) / (double(size.width) * size.height);
    least = std::min(least, fraction);
    most = std::max(most, fraction);
    ++count;
    std::cerr << fmt::format("\rframe {}, {:.1f} % object pixels, brightness {:.2f} {:.2f} {:.2f} ",
                             frame, 100 * fraction, found.gain[2], found.gain[1], found.gain[0])
              << std::flush;
  }
  std::cerr << '\n';
  if (count == 0)
    throw std::runtime_error(
        fmt::format("{}: has no frame {}", options.clip.string(), range->first));
  std::cout << fmt::format(
      "{} frame{}{}, {:.1f} to {:.1f} % object pixels\n"
      "{}: red are object pixels, blue is shadow, yellow differs but was dropped\n",
      count, count == 1 ? "" : "s", missing > 0 ? fmt::format(", {} missing", missing) : "",
      100 * least, 100 * most, (options.out / "overlays").string());
  return 0;
}

}  // namespace
}  // namespace fivepipe::capture

int main(int argc, char** argv) {
  fivepipe::capture::Options options;
  CLI::App app(
      "fivepipe segment: segments a clip. Writes for each frame OUT/masks/FRAME.png (255: object) "
      "and OUT/overlays/FRAME.png (red: object, blue: shadow, yellow: differs, but dropped), and "
      "the settings to OUT/segmentation.yaml, as they belong below `segmentation` in a "
      "deployment. Removes the pictures of an earlier run.\n\n"
      "Examples:\n"
      "  fivepipe segment cam1.mp4 --background empty.mp4 --out out/segment\n"
      "  fivepipe segment cam1.mp4 --frames 100:200:10 --set threshold_floor_levels=12 --set "
      "conservative=true --out out/segment\n\n"
      "Exit codes: 0 written, 1 a file cannot be read or written, 2 usage or settings.");
  app.add_option("clip", options.clip,
                 "video, sequence by a printf pattern such as frame_%04d.png, or picture")
      ->required();
  app.add_option("--out", options.out, "output folder")->required();
  app.add_option("--background", options.background,
                 "the empty scene: video, sequence or picture. Without it, the first images of the "
                 "clip show it");
  app.add_option("--background-frames", options.background_frames,
                 "number of these images (default 30)")
      ->check(CLI::Range(1, fivepipe::config::kMaxLearningImages));
  app.add_option("--frames", options.frames, "N, A:B or A:B:STEP, from 0 (default: all)");
  app.add_option("--region", options.region,
                 "picture of the clip's size: objects are only searched where it is not black");
  app.add_option("--set", options.settings,
                 "KEY=VALUE: a key of `segmentation`; see docs/configuration.md")
      ->allow_extra_args(false);
  try {
    app.parse(argc, argv);
    return fivepipe::capture::run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const fivepipe::config::ConfigError& error) {
    return std::cerr << error.what() << '\n', 2;
  } catch (const std::exception& error) {
    return std::cerr << "fivepipe segment: " << error.what() << '\n', 1;
  }
}
