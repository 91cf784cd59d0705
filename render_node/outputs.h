// Where composited frames are kept: a video file and still images.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <future>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <string>
#include <thread>

namespace fivepipe::render {

// A file can't be written; what() names it and says why.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct VideoOptions {
  double frame_rate_hz = 30;
  std::size_t queue_frames = 30;  // waiting for the encoder; a full queue refuses the newest
  std::uintmax_t min_free_bytes =
      64 * 1024 *
      1024;  // writing stops while this much is left, so that the file can still be closed
};

// An MP4 file, encoded in a thread of its own at low priority (H.264; MPEG-4 part 2 where OpenCV
// has no H.264 encoder). It can be played once finish() has returned, not before: MP4 has its index
// at the end. A process that is told to end must come by finish() or the destructor.
class VideoFile {
 public:
  // Throws OutputError where the file can't be made. An existing file is replaced.
  VideoFile(const std::filesystem::path& file, cv::Size size_px, const VideoOptions& options = {});
  ~VideoFile();  // finishes; errors are lost
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  // Takes over an 8-bit BGR image of the file's size, which must not be written to afterwards.
  // Never waits; false: dropped and counted, because the queue is full or writing has failed
  // (failure() says how).
  bool add(const cv::Mat& image_bgr);

  // Encodes what is queued, for at most `timeout`, and closes the file; frames left over are
  // counted as dropped. Throws OutputError where the file is not whole. Again: does nothing.
  void finish(std::chrono::milliseconds timeout = kFinishTimeout);
  // A process told to end has two seconds for everything; the index of the file takes its part.
  static constexpr std::chrono::milliseconds kFinishTimeout{700};

  std::uint64_t written() const;
  std::uint64_t dropped() const;
  std::string failure() const;                         // empty: none so far
  const std::string& codec() const { return codec_; }  // avc1 or mp4v

 private:
  void encode(std::promise<std::string> opened);
  void close(std::chrono::milliseconds timeout);

  std::filesystem::path file_;
  cv::Size size_px_;
  VideoOptions options_;
  std::string codec_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<cv::Mat> queue_;
  bool ending_ = false;
  std::chrono::steady_clock::time_point give_up_;  // once ending: what is queued then is dropped
  std::uint64_t written_ = 0, dropped_ = 0;
  std::string failure_;
  std::thread encoder_;
};

// A PNG that is either whole or not there: written beside its place, then renamed. Throws
// OutputError.
void write_png(const std::filesystem::path& file, const cv::Mat& image_bgr);

}  // namespace fivepipe::render
