// Writes composited frames to a video file and to still images.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <future>
#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/base/containers/bounded_queue.h"

namespace cv {
class VideoWriter;
}

namespace fivepipe::render {

// A file cannot be written; what() names the file and the reason.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct VideoOptions {
  double frame_rate_hz = 30;
  std::size_t queue_frames = 30;  // at most this many wait for the encoder; add() drops the rest
  // Writing stops when less than this is free on the disk, so that the file can still be closed.
  std::uintmax_t min_free_bytes = 64 * 1024 * 1024;
};

// An MP4 file that a separate low-priority thread encodes as H.264, or as MPEG-4 part 2 if OpenCV
// has no H.264 encoder. MP4 stores its index at the end, so the file is playable only after
// finish() or the destructor has returned: a process must call one of them before it exits.
class VideoFile {
 public:
  // Creates or replaces the file. Throws OutputError if that fails or size_px is not even.
  VideoFile(const std::filesystem::path& file, cv::Size size_px, const VideoOptions& options = {});
  ~VideoFile();  // calls finish() and ignores its errors
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // Queues an 8-bit BGR image of the file's size, which the caller must not modify afterwards.
  // Never waits. Returns false if it drops and counts the image, because the queue is full, an
  // earlier write failed, or the image has another size or type.
  bool add(const cv::Mat& image_bgr);

  // Encodes the queued frames for at most `timeout`, then closes the file and counts the remaining
  // frames as dropped. Throws OutputError if the file is incomplete. A second call does nothing.
  void finish(std::chrono::milliseconds timeout = kFinishTimeout);
  // After Ctrl-C the supervisor kills a node that has not exited within 1.3 s. Writing the index
  // takes a part of that time.
  static constexpr std::chrono::milliseconds kFinishTimeout{700};

  std::uint64_t dropped() const { return dropped_; }

 private:
  using Clock = std::chrono::steady_clock;

  void encode(std::promise<bool> opened);
  std::string write(cv::VideoWriter& writer, const cv::Mat& image_bgr) const;
  void close(std::chrono::milliseconds timeout);

  std::filesystem::path file_;
  cv::Size size_px_;
  VideoOptions options_;
  base::BoundedQueue<cv::Mat> queue_;
  std::atomic<Clock::time_point> deadline_;  // the encoder drops the frames queued at this time
  std::atomic<std::uint64_t> dropped_ = 0;
  // The encoder thread writes these; finish() reads them after it has joined the thread.
  std::uint64_t written_ = 0;
  std::string failure_;  // why a write failed; empty if none has
  std::thread encoder_;
};

// Writes a PNG atomically: writes FILE.part, then renames it. Throws OutputError.
void write_png(const std::filesystem::path& file, const cv::Mat& image_bgr);

}  // namespace fivepipe::render
