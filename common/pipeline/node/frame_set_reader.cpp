#include "common/pipeline/node/frame_set_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "common/pipeline/node/status_names.h"

namespace fivepipe::node {

FrameSetOptions frame_set_options(const config::Deployment& deployment) {
  return {deployment.hull_rule, deployment.coverage, config::dispensable_cameras(deployment)};
}

FrameSetReader::FrameSetReader(bus::Bus& bus, const config::Rig& rig, NodeStatusReporter& status,
                               FrameSetOptions options)
    : rig_(rig),
      status_(status),
      options_(std::move(options)),
      infos_(bus.reader<bus::topics::CameraInfo>()),
      coverages_(options_.want_coverage ? std::optional(bus.reader<bus::topics::ObjectCoverage>())
                                        : std::nullopt),
      maps_(bus.reader<bus::topics::ObjectPixelMap>()),
      coverage_joiner_(rig),
      sets_(rig, options_.dispensable) {}

void FrameSetReader::reset() {
  coverage_joiner_.reset();
  sets_.reset();
}

void FrameSetReader::take_coverages(ReplayMonitor& replay) {
  if (!coverages_) return;
  // One take() returns a part of the samples, key by key. The number of times is bounded, because a
  // peer may send without end.
  for (int times = 0; times < kMaxTakes; ++times)
    if (replay.take(*coverages_, [&](const auto& sample) { add_coverage(sample); }) == 0) return;
}

void FrameSetReader::add_coverage(const bus::Sample<bus::topics::ObjectCoverage>& sample) {
  auto received = messages::coverage_from(*sample, rig_);
  if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&received)) {
    status_.drop_from(coverages_->process(sample), *bad);
    return;
  }
  // The process of a writer is known as long as the writer exists, so it is queried here, too.
  coverages_->process(sample);
  coverage_joiner_.add(sample.writer(), std::move(std::get<messages::CameraCoverage>(received)));
}

void FrameSetReader::join_coverage(frames::FrameSet& set) {
  if (!coverages_) return;
  // Programs that state no identity count as one process.
  const auto is_same_process = [&](std::uint64_t of_coverage, std::uint64_t of_map) {
    return coverages_->process(of_coverage) == maps_.process(of_map);
  };
  for (const std::string& camera : coverage_joiner_.join(set, is_same_process))
    status_.drop({"missing_coverage", camera, ""});
}

void FrameSetReader::check_cameras() {
  for (const auto& sample : infos_.take()) {
    if (!sample.valid()) continue;
    const Mismatch sent{sample->camera, infos_.process(sample),
                        messages::model_mismatch(*sample, rig_)};
    if (!messages::camera_index(rig_, sample->camera)) {
      status_.drop_from(sent.process, {"bad_camera_info", sent.camera, sent.why});
      continue;
    }
    std::erase_if(mismatches_,
                  [&](const Mismatch& known) { return known.is_of(sent.camera, sent.process); });
    if (!sent.why.empty()) {
      status_.refuse(sent.process, 1);
      mismatches_.push_back(sent);
      if (mismatches_.size() > kMaxMismatches) mismatches_.pop_front();
    }
    report_mismatch(sent.camera);
  }
}

// Reports the newest mismatch of the camera: another process may publish the right model.
void FrameSetReader::report_mismatch(const std::string& camera) {
  const auto newest =
      std::find_if(mismatches_.rbegin(), mismatches_.rend(),
                   [&](const Mismatch& mismatch) { return mismatch.camera == camera; });
  status_.diagnostic("camera " + camera, newest == mismatches_.rend()
                                             ? ""
                                             : bus::text_of(newest->process) + ": " + newest->why);
}

bool FrameSetReader::is_mismatched(const std::string& camera,
                                   const std::optional<bus::ProcessId>& process) const {
  return std::any_of(mismatches_.begin(), mismatches_.end(),
                     [&](const Mismatch& mismatch) { return mismatch.is_of(camera, process); });
}

void FrameSetReader::report_lost_cameras() {
  const std::vector<std::string> lost = sets_.lost_cameras();
  std::vector<std::string> needed;
  for (const std::string& camera : lost)
    if (!options_.dispensable.contains(camera)) needed.push_back(camera);
  status_.diagnostic(
      "lost cameras",
      lost.empty() ? ""
      : needed.empty()
          ? fmt::format("{}; the hull uses only the other cameras", fmt::join(lost, ", "))
          : fmt::format("{}; frames without the object pixels of {} are dropped, because their "
                        "capture_node has no `lost_camera: continue`",
                        fmt::join(lost, ", "), fmt::join(needed, ", ")));
}

std::vector<frames::FrameSet> FrameSetReader::take(ReplayMonitor& replay) {
  check_cameras();
  std::vector<frames::FrameSet> complete;
  // capture_node sends the coverage before the map. Taking the maps first guarantees that the
  // coverage of all taken maps is available.
  const auto maps = maps_.take();
  replay.update();
  take_coverages(replay);
  for (const auto& sample : maps) {
    if (!sample.valid() || replay.precedes_replay(sample)) continue;
    if (is_mismatched(sample->camera, maps_.process(sample))) {
      status_.drop_from(maps_.process(sample),
                        {"bad_map", sample->camera, "published camera model differs from the rig"});
      continue;
    }
    auto received = messages::object_pixels_from(*sample, rig_);
    if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&received)) {
      status_.drop_from(maps_.process(sample), *bad);
      continue;
    }
    frames::CameraMap& map = std::get<frames::CameraMap>(received);
    map.received_ns = sample.arrived_ns();
    map.writer = sample.writer();
    for (frames::FrameSet& set : sets_.add(std::move(map))) {
      join_coverage(set);
      complete.push_back(std::move(set));
    }
  }
  for (const auto& [reason, n] : sets_.take_drops()) status_.drop(reason, n);
  for (const frames::FrameSet& set : complete) {
    status_.count(kFrameSetsComplete);
    status_.latency("set_skew", 1e-9 * double(set.skew_ns));
    const std::string empty =
        empty_hull_text(set.empty_cameras, options_.rule, set.silhouettes.size());
    if (!empty.empty())
      for (const std::string& camera : set.empty_cameras) status_.empty_camera(camera);
    status_.diagnostic("hull", empty);
  }
  report_lost_cameras();
  return complete;
}

}  // namespace fivepipe::node
