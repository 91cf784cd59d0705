#include "common/recording/files/frame_groups.h"

#include <algorithm>

#include "common/base/realtime.h"

namespace fivepipe::recording {
namespace {

// Number of returned frames that are remembered, to recognise their late messages.
constexpr std::size_t kMaxEmittedFrames = 256;

}  // namespace

FrameGroups::FrameGroups(const Recording& recording, Recording::Cursor cursor,
                         std::function<int(const std::string&)> rank)
    : cursor_(std::move(cursor)), rank_(std::move(rank)), frame_id_reader_(recording) {}

std::optional<FrameId> FrameIdReader::operator()(const RecordedMessage& message) {
  if (message.key_change) return std::nullopt;
  auto fields = fields_.find(message.channel->id);
  if (fields == fields_.end()) {
    const schema::Idl& idl = recording_.idl(*message.channel);
    const std::string& type_name = message.channel->type;
    const schema::Struct* type = idl.find(type_name);
    fields = fields_.emplace(message.channel->id, std::nullopt).first;
    // NodeStatus names a frame but does not belong to it: it has no capture stamp.
    if (type && type->find("frame") && type->find("capture_stamp_ns"))
      fields->second = Fields{schema::FieldReader(idl, type_name, "frame"),
                              schema::FieldReader(idl, type_name, "capture_stamp_ns")};
  }
  if (!fields->second) return std::nullopt;
  const auto frame = fields->second->frame.read(message.cdr),
             stamp = fields->second->capture_stamp_ns.read(message.cdr);
  if (!frame || !stamp || !std::holds_alternative<std::uint64_t>(*frame) ||
      !std::holds_alternative<std::int64_t>(*stamp))
    return std::nullopt;
  return FrameId{std::get<std::uint64_t>(*frame), std::get<std::int64_t>(*stamp)};
}

bool FrameGroups::read_message() {
  const auto message = cursor_.next();
  if (!message) return false;
  OwnedMessage kept{message->channel,
                    message->log_stamp_ns,
                    message->source_stamp_ns,
                    message->key_change,
                    {message->cdr.begin(), message->cdr.end()},
                    0};
  const auto frame = frame_id_reader_(*message);
  if (frame) {
    kept.capture_stamp_ns = frame->capture_stamp_ns;
    const auto of_this_run = [&](std::int64_t capture_stamp_ns) {
      return base::distance_ns(frame->capture_stamp_ns, capture_stamp_ns) < kMaxFrameSpan_ns;
    };
    const auto of_this_frame = [&](const FrameGroup& group) {
      return group.frame == frame->frame && of_this_run(group.capture_stamp_ns);
    };
    if (const auto open = std::find_if(open_.rbegin(), open_.rend(), of_this_frame);
        open != open_.rend()) {
      open->messages.push_back(std::move(kept));
      return true;
    }
    if (const auto before = emitted_.find(frame->frame);
        before != emitted_.end() && of_this_run(before->second)) {
      ++late_;
      open_.push_back({std::nullopt, kept.log_stamp_ns, 0, {}});
      open_.back().messages.push_back(std::move(kept));
      return true;
    }
    ++open_frames_;
  }
  open_.push_back({frame ? std::optional(frame->frame) : std::nullopt,
                   kept.log_stamp_ns,
                   frame ? frame->capture_stamp_ns : 0,
                   {}});
  open_.back().messages.push_back(std::move(kept));
  return true;
}

FrameGroup FrameGroups::pop_oldest() {
  FrameGroup group = std::move(open_.front());
  open_.pop_front();
  if (group.frame) {
    --open_frames_;
    emitted_[*group.frame] = group.capture_stamp_ns;
    if (emitted_.size() > kMaxEmittedFrames)
      emitted_.erase(
          std::min_element(emitted_.begin(), emitted_.end(),
                           [](const auto& a, const auto& b) { return a.second < b.second; }));
  }
  std::stable_sort(group.messages.begin(), group.messages.end(),
                   [&](const OwnedMessage& a, const OwnedMessage& b) {
                     return rank_(a.channel->topic) < rank_(b.channel->topic);
                   });
  return group;
}

std::optional<FrameGroup> FrameGroups::next() {
  while (!ended_ && open_frames_ <= kReorderWindow_frames)
    if (!read_message()) ended_ = true;
  if (open_.empty()) return std::nullopt;
  return pop_oldest();
}

}  // namespace fivepipe::recording
