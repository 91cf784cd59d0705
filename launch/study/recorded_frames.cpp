#include "launch/study/recorded_frames.h"

#include <algorithm>

#include "common/pipeline/messages/camera_messages.h"
#include "common/recording/schema/cdr_cursor.h"

namespace fivepipe::study {
namespace {

using recording::Recording;
using recording::RecordingError;

std::set<mcap::Id> map_channels(const Recording& recording) {
  std::set<mcap::Id> channels;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (channel.topic == bus::topics::ObjectPixelMap::name && !channel.key_states)
      channels.insert(channel.id);
  if (channels.empty())
    throw RecordingError(recording.file().string() +
                         " contains no object-pixel maps, so there are no real objects in it; "
                         "record the topic " +
                         bus::topics::ObjectPixelMap::name);
  if (const auto differences = recording.type_differences(channels); !differences.empty())
    throw RecordingError(recording.file().string() +
                         " was recorded by another version of fivepipe: " + differences.front());
  return channels;
}

// The message of a payload whose type is that of this build. Borrows the payload.
fivepipe_v1_ObjectPixelMap map_from(std::span<const std::byte> cdr) {
  schema::CdrCursor cursor(cdr);
  fivepipe_v1_ObjectPixelMap map{};
  messages::set_text(map.camera, std::string(cursor.take_string(sizeof map.camera - 1)));
  map.frame = cursor.take<std::uint64_t>();
  map.capture_stamp_ns = cursor.take<std::int64_t>();
  map.image_width_px = cursor.take<std::int32_t>();
  map.image_height_px = cursor.take<std::int32_t>();
  for (std::int32_t* value :
       {&map.region.u0_px, &map.region.v0_px, &map.region.u1_px, &map.region.v1_px})
    *value = cursor.take<std::int32_t>();
  map.object_pixels = cursor.take<std::uint32_t>();
  map.encoding = fivepipe_v1_MapEncoding(cursor.take<std::uint32_t>());
  const std::uint32_t bytes = cursor.take_count(0);
  map.payload._buffer = const_cast<std::uint8_t*>(
      reinterpret_cast<const std::uint8_t*>(cursor.take_bytes(bytes).data()));
  map.payload._length = map.payload._maximum = bytes;
  return map;
}

messages::Received<frames::CameraMap> received(std::span<const std::byte> cdr,
                                               const config::Rig& rig) {
  try {
    return messages::object_pixels_from(map_from(cdr), rig);
  } catch (const schema::CdrFault& fault) {
    return messages::BadMessage{"bad_map", "", fault.what};
  }
}

}  // namespace

RecordedFrames::RecordedFrames(const Recording& recording, const config::Deployment& deployment)
    : recording_(recording),
      rig_(deployment.rig),
      cursor_(
          recording.messages(recording.start_ns(), recording.end_ns(), map_channels(recording))),
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

std::optional<frames::FrameSet> RecordedFrames::next_set() {
  while (const auto message = next_message()) {
    if (message->key_change) continue;
    const double length_ns = double(recording_.end_ns() - recording_.start_ns());
    done_ = length_ns > 0 ? double(message->log_stamp_ns - recording_.start_ns()) / length_ns : 1;
    auto map = received(message->cdr, rig_);
    if (const auto* bad = std::get_if<messages::BadMessage>(&map)) {
      count(bad->reason, messages::text_of(*bad));
      continue;
    }
    // A channel is one writer. 0 is none.
    std::get<frames::CameraMap>(map).writer = std::uint64_t(message->channel->id) + 1;
    std::vector<frames::FrameSet> sets =
        assembler_.add(std::get<frames::CameraMap>(std::move(map)));
    for (const auto& [reason, count] : assembler_.take_drops()) drops_[reason] += count;
    if (!sets.empty()) return std::move(sets.front());
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
  return frame;
}

}  // namespace fivepipe::study
