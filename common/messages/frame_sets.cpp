#include "common/messages/frame_sets.h"

#include <algorithm>
#include <utility>

namespace fivepipe {

FrameSets::FrameSets(const Rig& rig) : rig_(rig), shape_cameras_(shape_cameras(rig)) {}

bool FrameSets::is_lost(std::size_t camera, std::uint64_t at_frame) const {
  const auto newest = newest_frame_of_camera_.find(camera);
  // A camera never seen is given as long as one that fell silent at the first frame.
  const std::uint64_t heard = newest == newest_frame_of_camera_.end() ? *first_frame_ : newest->second;
  return heard + kLostAfterFrames <= at_frame;
}

bool FrameSets::is_complete(std::uint64_t frame, const Incomplete& set) const {
  return std::all_of(shape_cameras_.begin(), shape_cameras_.end(),
                     [&](std::size_t camera) { return set.map_of_camera.contains(camera) || is_lost(camera, frame); });
}

FrameSet FrameSets::finished(std::uint64_t frame, Incomplete set) const {
  FrameSet result{frame, 0, 0, {}, {}, {}};
  std::int64_t latest_ns = 0;
  for (const std::size_t camera : shape_cameras_) {
    const auto found = set.map_of_camera.find(camera);
    if (found == set.map_of_camera.end()) {
      result.lost_cameras.push_back(rig_.cameras[camera].name);
      continue;
    }
    CameraMap& map = found->second;
    result.capture_stamp_ns = result.silhouettes.empty() ? map.capture_stamp_ns : std::min(result.capture_stamp_ns, map.capture_stamp_ns);
    latest_ns = result.silhouettes.empty() ? map.capture_stamp_ns : std::max(latest_ns, map.capture_stamp_ns);
    if (map.pixels.count() == 0) result.empty_cameras.push_back(rig_.cameras[camera].name);
    result.silhouettes.push_back({published_camera(rig_.cameras[camera]), std::move(map.pixels)});
  }
  result.skew_ns = latest_ns - result.capture_stamp_ns;
  return result;
}

std::vector<FrameSet> FrameSets::add(CameraMap map) {
  const std::uint64_t frame = map.frame;
  const std::size_t camera = map.camera;
  if (!first_frame_) first_frame_ = frame;
  // Numbers that jump back by more than a late map can: capture_node was started anew.
  if (last_handed_out_ && frame + kLostAfterFrames + kMaxIncomplete < *last_handed_out_) {
    drops_["incomplete_set"] += incomplete_.size();
    incomplete_.clear();
    newest_frame_of_camera_.clear();
    last_handed_out_.reset();
    first_frame_ = frame;
  }
  std::uint64_t& newest = newest_frame_of_camera_[camera];
  newest = std::max(newest, frame);
  if (last_handed_out_ && frame <= *last_handed_out_) {
    ++drops_["late_map"];
    return {};
  }
  if (!incomplete_[frame].map_of_camera.try_emplace(camera, std::move(map)).second) {
    ++drops_["repeated_map"];
    return {};
  }
  std::vector<FrameSet> complete;
  const auto found = incomplete_.find(frame);
  if (is_complete(frame, found->second)) {
    complete.push_back(finished(frame, std::move(found->second)));
    last_handed_out_ = frame;
    drops_["incomplete_set"] += std::uint64_t(std::distance(incomplete_.begin(), found));
    incomplete_.erase(incomplete_.begin(), std::next(found));
  }
  while (incomplete_.size() > kMaxIncomplete) {
    ++drops_["incomplete_set"];
    incomplete_.erase(incomplete_.begin());
  }
  return complete;
}

std::map<std::string, std::uint64_t> FrameSets::take_drops() {
  std::erase_if(drops_, [](const auto& drop) { return drop.second == 0; });
  return std::exchange(drops_, {});
}

}  // namespace fivepipe
