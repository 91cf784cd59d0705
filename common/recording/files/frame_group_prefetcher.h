// Reads the frames of a recording ahead in a thread, so that neither the disk nor decompression
// delays the replay.
#pragma once
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "common/recording/files/frame_groups.h"

namespace fivepipe::recording {

class FrameGroupPrefetcher {
 public:
  // The thread reads while fewer bytes than this are queued.
  static constexpr std::size_t kPrefetchBytes = std::size_t(256) << 20;

  explicit FrameGroupPrefetcher(FrameGroups groups, std::size_t ready_bytes = kPrefetchBytes);
  ~FrameGroupPrefetcher();
  FrameGroupPrefetcher(const FrameGroupPrefetcher&) = delete;
  FrameGroupPrefetcher& operator=(const FrameGroupPrefetcher&) = delete;

  // Waits until the queue is full or the recording has been read to its end.
  void wait_until_ready();
  // Waits for the next group; returns nullopt at the end. Skips damaged chunks; rethrows any other
  // exception of the reading thread.
  std::optional<FrameGroup> next();
  std::uint64_t late() const;     // FrameGroups::late()
  std::uint64_t damaged() const;  // chunks that could not be read

 private:
  void read();
  bool is_full() const { return bytes_ >= max_bytes_; }

  FrameGroups groups_;
  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<FrameGroup> ready_;
  std::size_t bytes_ = 0;
  std::uint64_t late_ = 0, damaged_ = 0;
  bool ended_ = false, stopping_ = false;
  std::exception_ptr failure_;
  std::thread reader_;
};

}  // namespace fivepipe::recording
