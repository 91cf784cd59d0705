#include "common/recording/frame_groups.h"

#include <algorithm>

namespace fivepipe::recording {
namespace {

// Frames remembered after they were handed out, for messages that come late.
constexpr std::size_t kRemembered = 256;

}  // namespace

FrameGroups::FrameGroups(const Recording& recording, Recording::Cursor cursor, std::function<int(const std::string&)> rank)
    : cursor_(std::move(cursor)), rank_(std::move(rank)), frame_of_(recording) {}

std::optional<std::uint64_t> FrameOf::operator()(const RecordedMessage& message) {
  if (message.key_change) return std::nullopt;
  auto field = field_.find(message.channel->id);
  if (field == field_.end()) {
    const schema::Idl& idl = recording_.idl(*message.channel);
    const schema::Struct* type = idl.find(message.channel->type);
    field = field_.emplace(message.channel->id, std::nullopt).first;
    // A node's status tells of a frame, but is not of it: it has no capture stamp.
    if (type && type->find("frame") && type->find("capture_stamp_ns")) field->second.emplace(idl, message.channel->type, "frame");
  }
  if (!field->second) return std::nullopt;
  const auto value = field->second->read(message.cdr);
  if (!value) return std::nullopt;
  const auto* frame = std::get_if<std::uint64_t>(&*value);
  return frame ? std::optional(*frame) : std::nullopt;
}

bool FrameGroups::read_one() {
  const auto message = cursor_.next();
  if (!message) return false;
  KeptMessage kept{message->channel, message->log_stamp_ns, message->source_stamp_ns, message->key_change, {message->cdr.begin(), message->cdr.end()}};
  const auto frame = frame_of_(*message);
  if (frame) {
    const auto of_this_frame = [&](const FrameGroup& group) { return group.frame == frame && kept.log_stamp_ns - group.log_stamp_ns < kOneFrameTakes_ns; };
    if (const auto open = std::find_if(open_.rbegin(), open_.rend(), of_this_frame); open != open_.rend()) {
      open->messages.push_back(std::move(kept));
      return true;
    }
    if (const auto before = handed_out_.find(*frame); before != handed_out_.end() && kept.log_stamp_ns - before->second < kOneFrameTakes_ns) {
      ++late_;
      open_.push_back({std::nullopt, kept.log_stamp_ns, {}});
      open_.back().messages.push_back(std::move(kept));
      return true;
    }
    ++open_frames_;
  }
  open_.push_back({frame, kept.log_stamp_ns, {}});
  open_.back().messages.push_back(std::move(kept));
  return true;
}

FrameGroup FrameGroups::handed_out() {
  FrameGroup group = std::move(open_.front());
  open_.pop_front();
  if (group.frame) {
    --open_frames_;
    handed_out_[*group.frame] = group.log_stamp_ns;
    if (handed_out_.size() > kRemembered)
      handed_out_.erase(std::min_element(handed_out_.begin(), handed_out_.end(), [](const auto& a, const auto& b) { return a.second < b.second; }));
  }
  std::stable_sort(group.messages.begin(), group.messages.end(),
                   [&](const KeptMessage& a, const KeptMessage& b) { return rank_(a.channel->topic) < rank_(b.channel->topic); });
  return group;
}

std::optional<FrameGroup> FrameGroups::next() {
  while (!ended_ && open_frames_ <= kFramesAhead)
    if (!read_one()) ended_ = true;
  if (open_.empty()) return std::nullopt;
  return handed_out();
}

}  // namespace fivepipe::recording
