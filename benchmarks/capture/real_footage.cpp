#include "benchmarks/capture/real_footage.h"

#include <fmt/format.h>

#include <iostream>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>

#include "benchmarks/capture/outlines.h"
#include "benchmarks/capture/scores.h"
#include "capture_node/capture.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/config/deployment.h"

namespace fivepipe::capture_bench {
namespace {

namespace fs = std::filesystem;

// Object pixels of captured images, by camera and frame.
using Maps = std::map<std::pair<std::string, int>, hull::ObjectPixels>;

Maps segmented(const config::Deployment& deployment, const std::vector<Outline>& outlines) {
  config::CaptureConfig config;
  for (const config::Node& node : deployment.nodes)
    if (const auto* capture = std::get_if<config::CaptureConfig>(&node.config)) config = *capture;
  // A frame beyond the end of a file must not be one of its first frames again.
  config.loop = false;
  config.precomputed_frames = 0;
  capture::Capture capture(deployment.rig, deployment.viewer, config, deployment.frame_rate_hz);
  std::set<int> frames;
  for (const Outline& outline : outlines) frames.insert(outline.frame);
  Maps maps;
  std::mutex mutex;
  for (const int frame : frames) {
    capture.set_observer([&, frame](const config::RigCamera& camera, const cv::Mat&,
                                    const capture::Segmentation& segmentation) {
      const std::lock_guard lock(mutex);
      maps[{camera.name, frame}] = segmentation.object;
    });
    for (const capture::CapturedCamera& camera : capture.capture(frame, false))
      if (camera.status != capture::CaptureStatus::captured)
        throw std::runtime_error(fmt::format("camera {}: no image of frame {}: {}", camera.camera,
                                             frame, camera.reason));
  }
  return maps;
}

// Scores by camera.
struct OfCamera {
  Score score;
  double least_iou = 1;
  int images = 0;
};
std::map<std::string, OfCamera> scores(const std::vector<Outline>& outlines, const Maps& maps) {
  std::map<std::string, OfCamera> result;
  for (const Outline& outline : outlines) {
    const auto found = maps.find({outline.camera, outline.frame});
    if (found == maps.end())
      throw std::runtime_error(fmt::format("there is an outline of camera {}, frame {}, but no map",
                                           outline.camera, outline.frame));
    const hull::ObjectPixels& pixels = found->second;
    const hull::ObjectPixels truth = pixels_inside(outline, pixels.width_px(), pixels.height_px());
    OfCamera& of_camera = result[outline.camera];
    Score one;
    one.add(pixels, truth);
    of_camera.score.add(pixels, truth);
    of_camera.least_iou = std::min(of_camera.least_iou, one.iou());
    ++of_camera.images;
  }
  return result;
}

void add_rows(base::TextTable& table, const char* what,
              const std::map<std::string, OfCamera>& by_camera) {
  for (const auto& [camera, of] : by_camera)
    table.add({what, camera, std::to_string(of.images), base::with_decimals(of.score.iou(), 3),
               base::with_decimals(of.least_iou, 3), base::with_decimals(of.score.recall(), 3),
               base::with_decimals(of.score.boundary_error_px(), 2)});
}

}  // namespace

nlohmann::ordered_json measure_footage(const fs::path& data) {
  const fs::path root = FIVEPIPE_SOURCE_DIR, drawn = root / "benchmarks/footage/outlines";
  const config::Deployment deployment = config::load_deployment(
      root / "launch/deployments/seated4cam.yaml", {{"data", fs::absolute(data).string()}});
  const std::vector<Outline> outlines = read_outlines(drawn / "seated4cam"),
                             again = read_outlines(drawn / "seated4cam_again");
  Maps first;  // the first drawing of the images that were drawn twice
  for (const config::RigCamera& camera : deployment.rig.cameras)
    for (const Outline& outline : outlines)
      if (outline.camera == camera.name)
        first[{outline.camera, outline.frame}] =
            pixels_inside(outline, camera.source.width_px, camera.source.height_px);
  const auto of_fivepipe = scores(outlines, segmented(deployment, outlines));
  base::TextTable table({{"seated4cam"},
                         {"camera"},
                         {"images", true},
                         {"IoU", true},
                         {"least IoU", true},
                         {"recall", true},
                         {"boundary, px", true}});
  add_rows(table, "fivepipe and the outlines", of_fivepipe);
  add_rows(table, "outlines, drawn twice", scores(again, first));
  std::cout << table.text() << '\n';
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const auto& [camera, of] : of_fivepipe)
    results.push_back(
        {{"name", "capture/seated4cam/" + camera},
         {"time_ms", base::times_json({})},
         {"error",
          {{"one_minus_iou", 1 - of.score.iou()}, {"boundary_px", of.score.boundary_error_px()}}}});
  return results;
}

}  // namespace fivepipe::capture_bench
