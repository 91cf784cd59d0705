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
#include "capture_node/lens/undistortion.h"
#include "common/base/machine.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/base/worker_pool.h"
#include "common/config/deployment.h"
#include "common/hull/carving_diagnosis.h"

namespace fivepipe::capture_bench {
namespace {

namespace fs = std::filesystem;

// Object pixels of captured images, by camera and frame.
using Maps = std::map<std::pair<std::string, int>, hull::ObjectPixels>;

struct Recording {
  std::string name;     // of its folder, of its deployment and of the folder of its outlines
  bool is_drawn_twice;  // some images, by two persons
  int volume_frames;    // frames whose hull volume is measured; 0: none
};
const Recording kRecordings[] = {{"seated4cam", true, 0}, {"balance4cam", false, 100}};

const Recording& recording_in(const fs::path& data) {
  const std::string name = fs::weakly_canonical(data).filename().string();
  for (const Recording& recording : kRecordings)
    if (recording.name == name) return recording;
  throw std::runtime_error(
      fmt::format("{}: there are no outlines of this recording. The folder must have the name "
                  "seated4cam or balance4cam",
                  data.string()));
}

// Captures frames of a deployment's files.
class Footage {
 public:
  explicit Footage(const config::Deployment& deployment)
      : deployment_(deployment),
        capture_(deployment.rig, deployment.viewer,
                 config::without_clock(config::capture_of_all_nodes(deployment)),
                 deployment.frame_rate_hz) {}

  // Throws if a camera has no image of the frame.
  std::vector<capture::CapturedCamera> at(int frame, const capture::Capture::Observer& observer) {
    capture_.set_observer(observer);
    std::vector<capture::CapturedCamera> set = capture_.capture(frame, false);
    for (const capture::CapturedCamera& camera : set)
      if (camera.status != capture::CaptureStatus::captured)
        throw std::runtime_error(fmt::format("camera {}: no image of frame {}: {}", camera.camera,
                                             frame, camera.reason));
    return set;
  }
  const config::Deployment& deployment() const { return deployment_; }

 private:
  const config::Deployment& deployment_;
  capture::Capture capture_;
};

Maps segmented(Footage& footage, const std::vector<Outline>& outlines) {
  std::set<int> frames;
  for (const Outline& outline : outlines) frames.insert(outline.frame);
  Maps maps;
  std::mutex mutex;
  for (const int frame : frames)
    footage.at(frame, [&](const config::RigCamera& camera, const cv::Mat&,
                          const capture::Segmentation& segmentation) {
      const std::lock_guard lock(mutex);
      maps[{camera.name, frame}] = segmentation.object;
    });
  return maps;
}

// Volume of the visual hull in the rig's volume_m [m^3], by frame.
std::vector<double> hull_volumes_m3(Footage& footage, int frames) {
  const config::Rig& rig = footage.deployment().rig;
  base::WorkerPool pool(base::core_count());
  std::vector<double> volumes;
  for (int frame = 0; frame < frames; ++frame) {
    std::vector<hull::Silhouette> silhouettes;
    for (capture::CapturedCamera& camera : footage.at(frame, {}))
      for (const config::RigCamera& in_rig : rig.cameras)
        if (in_rig.name == camera.camera && camera.pixels)
          silhouettes.push_back({config::published_camera(in_rig), std::move(*camera.pixels)});
    volumes.push_back(hull::diagnose_volume(silhouettes, rig.volume_m, pool).hull.volume_m3);
  }
  return volumes;
}

// The same of the outlines, in the frames in which every camera has one.
std::vector<double> outlined_volumes_m3(const config::Rig& rig,
                                        const std::vector<Outline>& outlines) {
  base::WorkerPool pool(base::core_count());
  std::map<int, std::vector<hull::Silhouette>> by_frame;
  for (const config::RigCamera& camera : rig.cameras) {
    const capture::Undistortion undistortion(camera);
    for (const Outline& outline : outlines)
      if (outline.camera == camera.name)
        by_frame[outline.frame].push_back(
            {config::published_camera(camera),
             undistortion.published(
                 pixels_inside(outline, camera.source.width_px, camera.source.height_px))});
  }
  std::vector<double> volumes;
  for (const auto& [frame, silhouettes] : by_frame)
    if (silhouettes.size() == rig.cameras.size())
      volumes.push_back(hull::diagnose_volume(silhouettes, rig.volume_m, pool).hull.volume_m3);
  return volumes;
}

std::string text_of(const std::vector<double>& volumes_m3) {
  return fmt::format("{} frames: {:.4f} to {:.4f} m3, median {:.4f}", volumes_m3.size(),
                     base::percentile(volumes_m3, 0), base::percentile(volumes_m3, 1),
                     base::percentile(volumes_m3, 0.5));
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
  const Recording& recording = recording_in(data);
  const fs::path root = FIVEPIPE_SOURCE_DIR, drawn = root / "benchmarks/footage/outlines";
  const config::Deployment deployment =
      config::load_deployment(root / "launch/deployments" / (recording.name + ".yaml"),
                              {{"data", fs::absolute(data).string()}});
  const std::vector<Outline> outlines = read_outlines(drawn / recording.name);
  Footage footage(deployment);
  const auto of_fivepipe = scores(outlines, segmented(footage, outlines));
  base::TextTable table({{recording.name},
                         {"camera"},
                         {"images", true},
                         {"IoU", true},
                         {"least IoU", true},
                         {"recall", true},
                         {"boundary, px", true}});
  add_rows(table, "fivepipe and the outlines", of_fivepipe);
  if (recording.is_drawn_twice) {
    Maps first;  // the first drawing of each image
    for (const config::RigCamera& camera : deployment.rig.cameras)
      for (const Outline& outline : outlines)
        if (outline.camera == camera.name)
          first[{outline.camera, outline.frame}] =
              pixels_inside(outline, camera.source.width_px, camera.source.height_px);
    add_rows(table, "outlines, drawn twice",
             scores(read_outlines(drawn / (recording.name + "_again")), first));
  }
  std::cout << table.text() << '\n';
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const auto& [camera, of] : of_fivepipe)
    results.push_back({{"name", "capture/" + recording.name + "/" + camera},
                       {"time_ms", base::times_json({})},
                       {"error",
                        {{"one_minus_iou", 1 - of.score.iou()},
                         {"one_minus_recall", 1 - of.score.recall()},
                         {"boundary_px", of.score.boundary_error_px()}}}});
  if (recording.volume_frames > 0) {
    Footage again(deployment);
    const std::vector<double> volumes = hull_volumes_m3(again, recording.volume_frames);
    std::cout << "volume of the hull in " << text_of(volumes) << "\nof the outlines' hull in "
              << text_of(outlined_volumes_m3(deployment.rig, outlines)) << "\n\n";
    results.push_back({{"name", "capture/" + recording.name + "/hull_volume_m3"},
                       {"time_ms", base::times_json({})},
                       {"values", volumes}});
  }
  return results;
}

}  // namespace fivepipe::capture_bench
