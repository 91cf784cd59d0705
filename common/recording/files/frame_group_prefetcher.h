// Reads the frames of a recording ahead in a thread, so that neither the disk nor decompression
// delays the replay.
#pragma once
#include <atomic>
#include <exception>
#include <optional>
#include <thread>

#include "common/base/containers/bounded_queue.h"
#include "common/recording/files/frame_groups.h"

namespace fivepipe::recording {

class FrameGroupPrefetcher {
 public:
  // Default of `ready_bytes`.
  static constexpr std::size_t kPrefetchBytes = std::size_t(256) << 20;

  // The thread reads while fewer than `ready_bytes` bytes are queued. The recording of `groups`
  // must outlive this object.
  explicit FrameGroupPrefetcher(FrameGroups groups, std::size_t ready_bytes = kPrefetchBytes);
  ~FrameGroupPrefetcher();
  FrameGroupPrefetcher(const FrameGroupPrefetcher&) = delete;
  FrameGroupPrefetcher& operator=(const FrameGroupPrefetcher&) = delete;

  // Waits until the queue is full or the recording has been read to its end.
  void wait_until_ready();
  // Waits for the next group; returns nullopt at the end. Skips damaged chunks; rethrows any other
  // exception of the reading thread.
  std::optional<FrameGroup> next();
  std::uint64_t late() const { return late_; }        // FrameGroups::late()
  std::uint64_t damaged() const { return damaged_; }  // chunks that could not be read

 private:
  void read();

  FrameGroups groups_;  // used by the thread only
  std::atomic<std::uint64_t> late_{0}, damaged_{0};
  std::exception_ptr failure_;  // written before the thread closes the queue, read after that
  base::BoundedQueue<FrameGroup> queue_;
  std::thread reader_;
};

}  // namespace fivepipe::recording
