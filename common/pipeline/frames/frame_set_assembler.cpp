#include "common/pipeline/frames/frame_set_assembler.h"

#include <algorithm>
#include <utility>

namespace fivepipe::frames {

FrameSetAssembler::FrameSetAssembler(const config::Rig& rig)
    : rig_(rig), shape_cameras_(config::shape_cameras(rig)) {
  for (const std::size_t camera : shape_cameras_) frames_missed_[camera] = 0;
}

bool FrameSetAssembler::is_complete(const Incomplete& set) const {
  return std::all_of(shape_cameras_.begin(), shape_cameras_.end(), [&](std::size_t camera) {
    return set.contains(camera) || frames_missed_.at(camera) >= kLostAfterFrames;
  });
}

// Closed: returned, older than a returned frame, or displaced.
bool FrameSetAssembler::is_closed(std::uint64_t frame) const {
  return (last_returned_ && frame <= *last_returned_) || incomplete_.was_displaced(frame);
}

void FrameSetAssembler::reset() {
  clear();
  restart_detector_ = {};
}

void FrameSetAssembler::clear() {
  drops_["incomplete_set"] += incomplete_.size();
  incomplete_.clear();
  newest_frame_.reset();
  last_returned_.reset();
}

FrameSet FrameSetAssembler::finished(std::uint64_t frame, Incomplete set) const {
  FrameSet result{frame, 0, 0, INT64_MAX, INT64_MIN, {}, {}, {}, {}};
  std::int64_t latest_ns = 0;
  for (const std::size_t camera : shape_cameras_) {
    const auto found = set.find(camera);
    if (found == set.end()) {
      result.lost_cameras.push_back(rig_.cameras[camera].name);
      continue;
    }
    CameraMap& map = found->second;
    result.capture_stamp_ns = result.silhouettes.empty()
                                  ? map.capture_stamp_ns
                                  : std::min(result.capture_stamp_ns, map.capture_stamp_ns);
    result.first_received_ns = std::min(result.first_received_ns, map.received_ns);
    result.last_received_ns = std::max(result.last_received_ns, map.received_ns);
    latest_ns = result.silhouettes.empty() ? map.capture_stamp_ns
                                           : std::max(latest_ns, map.capture_stamp_ns);
    if (map.pixels.count() == 0) result.empty_cameras.push_back(rig_.cameras[camera].name);
    result.silhouettes.push_back(
        {config::published_camera(rig_.cameras[camera]), std::move(map.pixels)});
    result.cameras.push_back(rig_.cameras[camera].name);
  }
  result.skew_ns = latest_ns - result.capture_stamp_ns;
  return result;
}

std::vector<FrameSet> FrameSetAssembler::add(CameraMap map) {
  const std::uint64_t frame = map.frame;
  const std::size_t camera = map.camera;
  if (restart_detector_.is_restart(frame, map.capture_stamp_ns)) clear();
  if (newest_frame_ && frame > *newest_frame_)
    for (const std::size_t other : shape_cameras_) ++frames_missed_[other];
  newest_frame_ = std::max(newest_frame_.value_or(frame), frame);
  frames_missed_[camera] = 0;
  if (is_closed(frame)) {
    ++drops_["late_map"];
    return {};
  }
  // If maps of one frame number have distant capture stamps, capture_node was restarted between
  // them.
  if (const Incomplete* const open = incomplete_.find(frame)) {
    const std::int64_t older_by_ns =
        base::difference_ns(open->begin()->second.capture_stamp_ns, map.capture_stamp_ns);
    if (older_by_ns > RestartDetector::kMinRestart_ns) {
      ++drops_["late_map"];
      return {};
    }
    if (older_by_ns < -RestartDetector::kMinRestart_ns) {
      ++drops_["incomplete_set"];
      incomplete_.take(frame);
    }
  }
  const auto& [set, displaced] = incomplete_.get_or_add(frame);
  drops_["incomplete_set"] += displaced;
  if (!set.try_emplace(camera, std::move(map)).second) {
    ++drops_["repeated_map"];
    return {};
  }
  if (!is_complete(set)) return {};
  std::vector<FrameSet> complete;
  complete.push_back(finished(frame, *incomplete_.take(frame)));
  last_returned_ = frame;
  drops_["incomplete_set"] += incomplete_.erase_up_to(frame);
  return complete;
}

std::map<std::string, std::uint64_t> FrameSetAssembler::take_drops() {
  std::erase_if(drops_, [](const auto& drop) { return drop.second == 0; });
  return std::exchange(drops_, {});
}

}  // namespace fivepipe::frames
