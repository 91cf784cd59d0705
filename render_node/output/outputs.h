// Writes composited frames to a video file and to still images.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <future>
#include <opencv2/core/mat.hpp>
#include <string>
#include <thread>

#include "common/base/containers/bounded_queue.h"
#include "render_node/output/output_error.h"
#include "render_node/output/video_module.h"

namespace fivepipe::render {

// What happens to an image if the queue of the encoder is full.
enum class WhenFull { drop, wait };

struct VideoOptions {
  double frame_rate_hz = 30;
  std::size_t queue_frames = 30;  // at most this many wait for the encoder
  // Writing stops when less than this is free on the disk: enough for the frames that the codec
  // still holds back, and for the other files of a run.
  std::uintmax_t min_free_bytes = 64 * 1024 * 1024;
};

// An MP4 file that a separate low-priority thread encodes (video_encoder.h). If the process ends
// without finish() or the destructor, the file is playable, but lacks its last frames: those that
// the codec held back and those of an incomplete fragment, about 2.5 s at 30 Hz.
class VideoFile {
 public:
  // Checks the arguments, the folder and the disk, and throws OutputError. The encoder's thread
  // then loads FFmpeg, and creates or replaces the file.
  VideoFile(const std::filesystem::path& file, cv::Size size_px, const VideoOptions& options = {});
  ~VideoFile();  // calls finish() and ignores its errors
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // Waits until the file is open. Throws OutputError if that failed; finish() does so, too.
  void wait_until_open();

  // Queues an 8-bit BGR image of the file's size, which the caller must not modify afterwards.
  // WhenFull::wait waits until fewer than kMaxAhead images are queued.
  // Returns false if it drops and counts the image, because the queue is full (WhenFull::drop), an
  // earlier write failed, or the image has another size or type.
  bool add(const cv::Mat& image_bgr, WhenFull when_full = WhenFull::drop);

  // Encodes the queued frames for at most `timeout`, then closes the file and counts the remaining
  // frames as dropped. Throws OutputError if the file is incomplete. A second call does nothing.
  void finish(std::chrono::milliseconds timeout = kFinishTimeout);
  // After Ctrl-C the supervisor kills a node that has not exited within 1.3 s. Encoding the frames
  // that the codec holds back takes a part of that time.
  static constexpr std::chrono::milliseconds kFinishTimeout{700};

  // With WhenFull::wait at most this many frames wait behind the one in the encoder, so that the
  // encoder of a busy machine finishes them within kFinishTimeout.
  static constexpr std::size_t kMaxAhead = 3;

  std::uint64_t dropped() const { return dropped_; }

 private:
  using Clock = std::chrono::steady_clock;

  void encode(std::promise<void> opened);
  void encode_frames(VideoWriter& encoder);
  std::string write(VideoWriter& encoder, const cv::Mat& image_bgr);
  void close(std::chrono::milliseconds timeout);

  std::filesystem::path file_;
  cv::Size size_px_;
  VideoOptions options_;
  base::BoundedQueue<cv::Mat> queue_;
  std::atomic<Clock::time_point> deadline_;  // the encoder drops the frames queued at this time
  std::atomic<std::uint64_t> dropped_ = 0;
  // The encoder thread writes these; finish() reads them after it has joined the thread.
  std::uint64_t written_ = 0;
  std::string failure_;       // why a write failed; empty if none has
  bool is_usable_ = true;     // the encoder: no write() of it has thrown
  std::future<void> opened_;  // valid until its result is taken
  std::thread encoder_;
};

// Lowers the priority of the calling thread, so that its work does not slow down the nodes.
void lower_priority();

// Writes a PNG atomically: writes FILE.part, then renames it. Throws OutputError.
void write_png(const std::filesystem::path& file, const cv::Mat& image_bgr);

}  // namespace fivepipe::render
