#include "common/pipeline/node/frame_set_reader.h"

#include "common/base/realtime.h"
#include "common/pipeline/messages/camera_messages.h"

namespace fivepipe::node {

FrameSetReader::FrameSetReader(bus::Bus& bus, const config::Rig& rig, NodeStatusReporter& status)
    : rig_(rig),
      status_(status),
      infos_(bus.reader<bus::topics::CameraInfo>()),
      maps_(bus.reader<bus::topics::ObjectPixelMap>()),
      sets_(rig) {}

void FrameSetReader::check_cameras() {
  for (const auto& sample : infos_.take()) {
    if (!sample.valid()) continue;
    const std::string camera = sample->camera, why = messages::model_mismatch(*sample, rig_);
    status_.diagnostic("camera " + camera, why);
    if (why.empty())
      mismatched_cameras_.erase(camera);
    else
      mismatched_cameras_.insert(camera);
  }
}

std::vector<frames::FrameSet> FrameSetReader::take() {
  check_cameras();
  std::vector<frames::FrameSet> complete;
  const std::int64_t now_ns = base::now_realtime_ns();
  for (const auto& sample : maps_.take()) {
    if (!sample.valid()) continue;
    if (mismatched_cameras_.contains(sample->camera)) {
      status_.drop("bad_map: " + std::string(sample->camera) +
                   ": published camera model differs from the rig");
      continue;
    }
    auto received = messages::object_pixels_from(*sample, rig_);
    if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&received)) {
      status_.drop(bad->why);
      continue;
    }
    frames::CameraMap& map = std::get<frames::CameraMap>(received);
    map.received_ns = now_ns;
    for (frames::FrameSet& set : sets_.add(std::move(map))) complete.push_back(std::move(set));
  }
  for (const auto& [reason, n] : sets_.take_drops()) status_.drop(reason, n);
  for (const frames::FrameSet& set : complete) {
    status_.count("frame_sets_complete");
    status_.latency("set_skew", 1e-9 * double(set.skew_ns));
    std::string empty, lost;
    for (const std::string& camera : set.empty_cameras)
      empty += (empty.empty() ? "" : ", ") + camera;
    for (const std::string& camera : set.lost_cameras) lost += (lost.empty() ? "" : ", ") + camera;
    for (const std::string& camera : set.empty_cameras) status_.count("empty_hull/" + camera);
    status_.diagnostic("empty hull",
                       empty.empty() ? "" : "empty hull: camera " + empty + " saw no object pixel");
    status_.diagnostic(
        "lost cameras",
        lost.empty() ? "" : "lost: camera " + lost + "; the hull is that of the others");
  }
  return complete;
}

}  // namespace fivepipe::node
