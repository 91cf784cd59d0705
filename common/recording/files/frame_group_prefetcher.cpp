#include "common/recording/files/frame_group_prefetcher.h"

namespace fivepipe::recording {
namespace {

std::size_t bytes_of(const FrameGroup& group) {
  std::size_t bytes = sizeof group;
  for (const OwnedMessage& message : group.messages) bytes += sizeof message + message.cdr.size();
  return bytes;
}

}  // namespace

FrameGroupPrefetcher::FrameGroupPrefetcher(FrameGroups groups, std::size_t ready_bytes)
    : groups_(std::move(groups)), queue_(ready_bytes) {
  reader_ = std::thread([this] { read(); });
}

FrameGroupPrefetcher::~FrameGroupPrefetcher() {
  queue_.close();
  reader_.join();
}

void FrameGroupPrefetcher::read() {
  for (bool more = true; more;) try {
      std::optional<FrameGroup> group = groups_.next();
      late_ = groups_.late();
      if (!group) break;
      const std::size_t bytes = bytes_of(*group);
      more = queue_.push(std::move(*group), bytes);
    } catch (const mcap::McapError&) {
      ++damaged_;
    } catch (...) {
      failure_ = std::current_exception();
      break;
    }
  queue_.close();
}

void FrameGroupPrefetcher::wait_until_ready() { queue_.wait_until_full_or_closed(); }

std::optional<FrameGroup> FrameGroupPrefetcher::next() {
  std::optional<FrameGroup> group = queue_.pop();
  if (!group && failure_) std::rethrow_exception(failure_);
  return group;
}

}  // namespace fivepipe::recording
