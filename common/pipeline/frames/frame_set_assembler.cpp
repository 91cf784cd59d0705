#include "common/pipeline/frames/frame_set_assembler.h"

#include <algorithm>
#include <utility>

namespace fivepipe::frames {

FrameSetAssembler::FrameSetAssembler(const config::Rig& rig,
                                     const std::set<std::string>& dispensable)
    : rig_(rig), shape_cameras_(config::shape_cameras(rig)) {
  for (const std::size_t camera : shape_cameras_) {
    frames_missed_[camera] = 0;
    if (dispensable.contains(rig.cameras[camera].name)) dispensable_.insert(camera);
  }
}

bool FrameSetAssembler::is_lost(std::size_t camera) const {
  return frames_missed_.at(camera) >= kLostAfterFrames;
}

std::vector<std::string> FrameSetAssembler::lost_cameras() const {
  std::vector<std::string> lost;
  for (const std::size_t camera : shape_cameras_)
    if (is_lost(camera)) lost.push_back(rig_.cameras[camera].name);
  return lost;
}

bool FrameSetAssembler::is_complete(const Incomplete& set) const {
  constexpr std::size_t kMinCameras = 2;
  if (set.size() < std::min(kMinCameras, shape_cameras_.size())) return false;
  return std::all_of(shape_cameras_.begin(), shape_cameras_.end(), [&](std::size_t camera) {
    return set.contains(camera) || (dispensable_.contains(camera) && is_lost(camera));
  });
}

// Closed: returned, older than a returned frame, or displaced.
bool FrameSetAssembler::is_closed(std::uint64_t frame) const {
  return (last_returned_ && frame <= *last_returned_) || incomplete_.was_displaced(frame);
}

void FrameSetAssembler::reset() {
  clear();
  writers_ = {};
}

void FrameSetAssembler::clear() {
  for (const auto& entry : incomplete_) drop(entry.frame, "incomplete_set");
  incomplete_.clear();
  dropped_.clear();
  late_.clear();
  newest_frame_.reset();
  last_returned_.reset();
  for (auto& [camera, missed] : frames_missed_) missed = 0;
  restart_detector_ = RestartDetector(RestartBy::writer);
}

// Counts the frame, unless it is already counted.
void FrameSetAssembler::drop(std::uint64_t frame, const char* reason) {
  if (dropped_.find(frame)) return;
  dropped_.get_or_add(frame);
  ++drops_[reason];
}

// Returns false if the map must be dropped, because its process is not the camera's. If the process
// has replaced another one, removes the maps of that one, so that maps of both are never combined.
// Then forgets all frames if no other process's maps remain, or if frame numbers begin again.
bool FrameSetAssembler::follow_writer(const CameraMap& map) {
  const CameraWriters::Verdict verdict = writers_.judge(map.camera, map.writer);
  if (!verdict.is_current) ++drops_["other_writer"];
  if (!verdict.replaced) return verdict.is_current;
  drop_maps_of(*verdict.replaced);
  if (incomplete_.size() == 0 || (last_returned_ && map.frame <= *last_returned_)) clear();
  return true;
}

// Counts a closed frame. Returns true after so many in a row that the frame which closed them must
// have been wrong, for example that of a peer.
bool FrameSetAssembler::count_late(std::uint64_t frame) {
  if (std::find(late_.begin(), late_.end(), frame) == late_.end()) late_.push_back(frame);
  return late_.size() >= RestartDetector::kMaxContradictions;
}

void FrameSetAssembler::drop_maps_of(std::uint64_t writer) {
  std::vector<std::uint64_t> emptied;
  for (auto& [frame, set] : incomplete_) {
    std::erase_if(set, [&](const auto& map) { return map.second.writer == writer; });
    if (set.empty()) emptied.push_back(frame);
  }
  for (const std::uint64_t frame : emptied) {
    incomplete_.take(frame);
    drop(frame, "incomplete_set");
  }
}

FrameSet FrameSetAssembler::finished(std::uint64_t frame, Incomplete set) const {
  FrameSet result{frame, 0, 0, INT64_MAX, INT64_MIN, {}, {}, {}, {}, {}, {}};
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
    result.sources.push_back({map.capture_stamp_ns, map.writer});
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
  if (!follow_writer(map)) return {};
  if (restart_detector_.is_restart(frame, map.capture_stamp_ns)) clear();
  if (newest_frame_ && frame > *newest_frame_)
    for (const std::size_t other : shape_cameras_) ++frames_missed_[other];
  newest_frame_ = std::max(newest_frame_.value_or(frame), frame);
  frames_missed_[camera] = 0;
  if (is_closed(frame)) {
    drop(frame, "late_map");
    if (!count_late(frame)) return {};
    clear();
  }
  const auto& [set, displaced] = incomplete_.get_or_add(frame);
  if (displaced) drop(*displaced, "incomplete_set");
  if (!set.try_emplace(camera, std::move(map)).second) {
    ++drops_["repeated_map"];
    return {};
  }
  if (!is_complete(set)) return {};
  std::vector<FrameSet> complete;
  complete.push_back(finished(frame, *incomplete_.take(frame)));
  last_returned_ = frame;
  late_.clear();
  for (const auto& entry : incomplete_)
    if (entry.frame <= frame) drop(entry.frame, "incomplete_set");
  incomplete_.erase_up_to(frame);
  return complete;
}

std::map<std::string, std::uint64_t> FrameSetAssembler::take_drops() {
  return std::exchange(drops_, {});
}

}  // namespace fivepipe::frames
