#include "common/node/frame_set_reader.h"

#include "common/clock/realtime.h"
#include "common/messages/camera_messages.h"

namespace fivepipe {

FrameSetReader::FrameSetReader(Bus& bus, const Rig& rig, NodeStatusReporter& status)
    : rig_(rig), status_(status), infos_(bus.reader<topics::CameraInfo>()), maps_(bus.reader<topics::ObjectPixelMap>()), sets_(rig) {}

void FrameSetReader::check_cameras() {
  for (const auto& sample : infos_.take()) {
    if (!sample.valid()) continue;
    const std::string camera = sample->camera, why = disagreement(*sample, rig_);
    status_.remark("camera " + camera, why);
    if (why.empty())
      disagreeing_cameras_.erase(camera);
    else
      disagreeing_cameras_.insert(camera);
  }
}

std::vector<FrameSet> FrameSetReader::take() {
  check_cameras();
  std::vector<FrameSet> complete;
  const std::int64_t now_ns = now_realtime_ns();
  for (const auto& sample : maps_.take()) {
    if (!sample.valid()) continue;
    if (disagreeing_cameras_.contains(sample->camera)) {
      status_.drop("bad_map: " + std::string(sample->camera) + ": published camera model differs from the rig");
      continue;
    }
    auto received = object_pixels_from(*sample, rig_);
    if (const BadMessage* bad = std::get_if<BadMessage>(&received)) {
      status_.drop(bad->why);
      continue;
    }
    CameraMap& map = std::get<CameraMap>(received);
    map.received_ns = now_ns;
    for (FrameSet& set : sets_.add(std::move(map))) complete.push_back(std::move(set));
  }
  for (const auto& [reason, n] : sets_.take_drops()) status_.drop(reason, n);
  for (const FrameSet& set : complete) {
    status_.count("frame_sets_complete");
    status_.latency("set_skew", 1e-9 * double(set.skew_ns));
    std::string empty, lost;
    for (const std::string& camera : set.empty_cameras) empty += (empty.empty() ? "" : ", ") + camera;
    for (const std::string& camera : set.lost_cameras) lost += (lost.empty() ? "" : ", ") + camera;
    for (const std::string& camera : set.empty_cameras) status_.count("empty_hull/" + camera);
    status_.remark("empty hull", empty.empty() ? "" : "empty hull: camera " + empty + " saw no object pixel");
    status_.remark("lost cameras", lost.empty() ? "" : "lost: camera " + lost + "; the hull is that of the others");
  }
  return complete;
}

}  // namespace fivepipe
