#include "common/pipeline/node/frame_set_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/base/realtime.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/node/status_names.h"

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
    const CameraOfProcess sent{sample->camera, infos_.process(sample)};
    const std::string why = messages::model_mismatch(*sample, rig_);
    mismatched_.erase(sent);
    if (!messages::camera_index(rig_, sample->camera)) {
      status_.drop_from(sent.second, {"bad_camera_info", sent.first, why});
      continue;
    }
    status_.diagnostic("camera " + sent.first,
                       why.empty() ? "" : bus::text_of(sent.second) + ": " + why);
    if (why.empty()) continue;
    status_.refuse(sent.second, 1);
    mismatched_.set(sent, {});
  }
}

std::vector<frames::FrameSet> FrameSetReader::take() {
  check_cameras();
  std::vector<frames::FrameSet> complete;
  const auto samples = maps_.take();
  const std::int64_t now_ns = base::now_realtime_ns();  // after the take: the node has the maps
  for (const auto& sample : samples) {
    if (!sample.valid()) continue;
    if (!mismatched_.empty() && mismatched_.contains({sample->camera, maps_.process(sample)})) {
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
    map.received_ns = now_ns;
    for (frames::FrameSet& set : sets_.add(std::move(map))) complete.push_back(std::move(set));
  }
  for (const auto& [reason, n] : sets_.take_drops()) status_.drop(reason, n);
  for (const frames::FrameSet& set : complete) {
    status_.count(kFrameSetsComplete);
    status_.latency("set_skew", 1e-9 * double(set.skew_ns));
    for (const std::string& camera : set.empty_cameras) status_.empty_camera(camera);
    status_.diagnostic("hull", empty_hull_text(set.empty_cameras));
    status_.diagnostic("lost cameras", set.lost_cameras.empty()
                                           ? ""
                                           : fmt::format("{}; the hull uses only the other cameras",
                                                         fmt::join(set.lost_cameras, ", ")));
  }
  return complete;
}

}  // namespace fivepipe::node
