#include "common/recording/replay/recorded_frames.h"

#include <algorithm>

#include "common/base/text_table.h"
#include "common/recording/replay/recorded_messages.h"

namespace fivepipe::replay {
namespace {

using recording::Recording;
using recording::RecordingError;

std::set<mcap::Id> channels_of(const Recording& recording, const char* topic) {
  std::set<mcap::Id> channels;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (channel.topic == topic && !channel.key_states) channels.insert(channel.id);
  return channels;
}

std::set<mcap::Id> channels_to_read(const Recording& recording, const FrameExtras& extras) {
  std::set<mcap::Id> channels = channels_of(recording, bus::topics::ObjectPixelMap::name);
  if (channels.empty())
    throw RecordingError(recording.file().string() +
                         " contains no object-pixel maps, so there are no real objects in it; "
                         "record the topic " +
                         bus::topics::ObjectPixelMap::name);
  if (extras.colours) channels.merge(channels_of(recording, bus::topics::ObjectColour::name));
  if (extras.head_poses) channels.merge(channels_of(recording, bus::topics::HeadPose::name));
  if (const auto differences = recording.type_differences(channels); !differences.empty())
    throw RecordingError(recording.file().string() +
                         " was recorded by another version of fivepipe: " + differences.front());
  return channels;
}

}  // namespace

RecordedFrames::RecordedFrames(const Recording& recording, const config::Deployment& deployment,
                               const FrameExtras& extras)
    : recording_(recording),
      rig_(deployment.rig),
      viewer_(deployment.viewer.name),
      cursor_(recording.messages(recording.start_ns(), recording.end_ns(),
                                 channels_to_read(recording, extras))),
      assembler_(deployment.rig, config::dispensable_cameras(deployment)) {
  waiting_ = next_set();
}

void RecordedFrames::count(const std::string& reason, const std::string& fault) {
  ++drops_[reason];
  if (first_fault_.empty()) first_fault_ = fault;
}

std::optional<recording::RecordedMessage> RecordedFrames::next_message() {
  for (;;) try {
      return cursor_.next();
    } catch (const mcap::McapError& error) {
      count("damaged_chunk", error.what());
    }
}

void RecordedFrames::add_extra(const recording::RecordedMessage& message) {
  const auto drop = [&](const messages::BadMessage& bad) {
    count(bad.reason, messages::text_of(bad));
  };
  if (message.channel->topic == bus::topics::ObjectColour::name) {
    auto colour = colour_from(message.cdr, rig_);
    if (const auto* bad = std::get_if<messages::BadMessage>(&colour)) return drop(*bad);
    auto& [camera, frame, stamp_ns, region] = std::get<messages::CameraColour>(colour);
    extras_.get_or_add(frame).value.colours[camera] = std::move(region);
  } else {
    const auto pose = head_pose_from(message.cdr);
    if (const auto* bad = std::get_if<messages::BadMessage>(&pose)) return drop(*bad);
    const auto& [viewer, of_frame] = std::get<RecordedPose>(pose);
    if (viewer == viewer_)
      extras_.get_or_add(of_frame.frame).value.eye_from_world = of_frame.eye_from_world;
  }
}

std::vector<frames::FrameSet> RecordedFrames::add_map(const recording::RecordedMessage& message) {
  auto map = map_from(message.cdr, rig_);
  if (const auto* bad = std::get_if<messages::BadMessage>(&map)) {
    count(bad->reason, messages::text_of(*bad));
    return {};
  }
  // A channel is one writer. 0 is none.
  std::get<frames::CameraMap>(map).writer = std::uint64_t(message.channel->id) + 1;
  std::vector<frames::FrameSet> sets = assembler_.add(std::get<frames::CameraMap>(std::move(map)));
  for (const auto& [reason, count] : assembler_.take_drops()) drops_[reason] += count;
  return sets;
}

std::optional<frames::FrameSet> RecordedFrames::next_set() {
  while (const auto message = next_message()) {
    if (message->key_change) continue;
    const double length_ns = double(recording_.end_ns() - recording_.start_ns());
    done_ = length_ns > 0 ? double(message->log_stamp_ns - recording_.start_ns()) / length_ns : 1;
    if (message->channel->topic != bus::topics::ObjectPixelMap::name)
      add_extra(*message);
    else if (std::vector<frames::FrameSet> sets = add_map(*message); !sets.empty())
      return std::move(sets.front());
  }
  assembler_.reset();
  for (const auto& [reason, count] : assembler_.take_drops()) drops_[reason] += count;
  done_ = 1;
  return std::nullopt;
}

std::optional<RecordedFrame> RecordedFrames::next() {
  if (!waiting_) return std::nullopt;
  RecordedFrame frame{std::move(*waiting_), 0, 0};
  waiting_ = next_set();
  if (waiting_)
    last_duration_s_ = std::clamp(
        1e-9 * double(waiting_->capture_stamp_ns - frame.set.capture_stamp_ns), 0.0, kMaxFrame_s);
  frame.duration_s = last_duration_s_;
  frame.done = done_;
  if (auto extras = extras_.take(frame.set.frame)) {
    for (auto& [camera, region] : extras->colours) frame.colours.push_back(std::move(region));
    frame.eye_from_world = extras->eye_from_world;
  }
  return frame;
}

std::string RecordedFrames::why_none() const {
  std::string why = recording_.file().string() +
                    " contains no complete frame: one map of each camera of the recorded rig that "
                    "gives shape";
  for (const auto& [reason, count] : drops_)
    why += "; dropped: " + std::to_string(count) + " " + reason;
  if (!first_fault_.empty()) why += ", first: " + base::printable(first_fault_);
  return why + "; `fivepipe info " + recording_.file().string() + "` lists what was recorded";
}

}  // namespace fivepipe::replay
