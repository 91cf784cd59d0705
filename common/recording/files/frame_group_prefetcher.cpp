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
    : groups_(std::move(groups)), max_bytes_(ready_bytes) {
  reader_ = std::thread([this] { read(); });
}

FrameGroupPrefetcher::~FrameGroupPrefetcher() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  reader_.join();
}

void FrameGroupPrefetcher::read() {
  std::unique_lock lock(mutex_);
  while (!ended_) {
    changed_.wait(lock, [this] { return stopping_ || !is_full(); });
    if (stopping_) return;
    lock.unlock();
    std::optional<FrameGroup> group;
    std::exception_ptr failure;
    bool damaged = false;
    try {
      group = groups_.next();
    } catch (const mcap::McapError&) {
      damaged = true;
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    late_ = groups_.late();
    failure_ = failure;
    damaged_ += damaged;
    ended_ = !group && !damaged;
    if (group) {
      bytes_ += bytes_of(*group);
      ready_.push_back(std::move(*group));
    }
    changed_.notify_all();
  }
}

void FrameGroupPrefetcher::wait_until_ready() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || is_full(); });
}

std::optional<FrameGroup> FrameGroupPrefetcher::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !ready_.empty(); });
  if (ready_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return std::nullopt;
  }
  FrameGroup group = std::move(ready_.front());
  ready_.pop_front();
  bytes_ -= bytes_of(group);
  lock.unlock();
  changed_.notify_all();
  return group;
}

std::uint64_t FrameGroupPrefetcher::late() const {
  const std::scoped_lock lock(mutex_);
  return late_;
}

std::uint64_t FrameGroupPrefetcher::damaged() const {
  const std::scoped_lock lock(mutex_);
  return damaged_;
}

}  // namespace fivepipe::recording
