#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <opencv2/videoio.hpp>
#include <thread>

#include "capture_node/sources/image_source.h"
#include "common/base/realtime.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

// USB cameras need seconds to start their stream.
constexpr auto kFirstImageTimeout = 5s;
// Ten periods of a slow camera (20 Hz). After this time the frame is missing.
constexpr auto kImageTimeout = 500ms;
// Lets the node exit within two seconds of Ctrl-C.
constexpr auto kReaderStopTimeout = 1s;

std::string path_of(const std::string& device) {
  const bool index = !device.empty() && device.find_first_not_of("0123456789") == std::string::npos;
  return index ? "/dev/video" + device : device;
}

// Explains the errno of a device that delivers no images, with the fix.
std::string hint(int error) {
  if (error == ENOSPC)
    return "not enough USB bandwidth (ENOSPC): connect the cameras to separate USB controllers, "
           "or request a smaller image (image_size_px in the rig)";
  if (error == EBUSY) return "another program uses the device";
  if (error == EACCES || error == EPERM)
    return "no permission to open it: add the user to the group video";
  if (error == 0) return "the device does not respond as a camera";
  return std::strerror(error);
}

// Shared with the reader thread, which may outlive the source while the driver blocks.
struct Stream {
  cv::VideoCapture video;
  std::mutex mutex;
  std::condition_variable changed;
  cv::Mat newest;
  std::int64_t newest_ns = 0;  // CLOCK_REALTIME at which it was taken
  std::uint64_t images = 0;    // number of images read so far
  int error = 0;
  bool stop = false, ended = false;
};

// Returns the time at which the image was taken (CLOCK_REALTIME): the kernel's stamp of the buffer,
// which is of CLOCK_MONOTONIC, if the driver sets it; otherwise the present time.
std::int64_t taken_ns(cv::VideoCapture& video) {
  constexpr double kNsPerMs = 1e6, kMaxAge_ns = 1e9;
  const std::int64_t now_ns = base::now_realtime_ns();
  const double age_ns =
      std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now().time_since_epoch())
          .count() -
      kNsPerMs * video.get(cv::CAP_PROP_POS_MSEC);
  return age_ns >= 0 && age_ns <= kMaxAge_ns ? now_ns - std::int64_t(age_ns) : now_ns;
}

void reader_loop(const std::shared_ptr<Stream>& stream) {
  for (;;) {
    cv::Mat image;
    errno = 0;
    const bool got = stream->video.read(image) && !image.empty();
    const int error = errno;
    const std::int64_t image_ns = got ? taken_ns(stream->video) : 0;
    const std::lock_guard lock(stream->mutex);
    if (got) {
      stream->newest = image;
      stream->newest_ns = image_ns;
      ++stream->images;
    } else {
      stream->error = error;
      stream->ended = true;
    }
    if (stream->stop) stream->ended = true;
    stream->changed.notify_all();
    if (stream->ended) return;
  }
}

class V4l2ImageSource final : public ImageSource {
 public:
  V4l2ImageSource(const config::RigCamera& camera, const config::V4l2Source& source)
      : name_(path_of(source.device)),
        width_px_(camera.source.width_px),
        height_px_(camera.source.height_px),
        stream_(std::make_shared<Stream>()) {
    const auto fail = [&](SourceFault fault, const std::string& what) {
      throw_problems({{camera.name, fault, name_ + ": " + what}});
    };
    if (std::error_code error; !fs::is_character_file(name_, error))
      fail(SourceFault::hardware_missing, "no such camera; " + connected_devices("/dev"));
    if (const int descriptor = ::open(name_.c_str(), O_RDWR | O_NONBLOCK); descriptor >= 0)
      ::close(descriptor);
    else
      fail(SourceFault::hardware_failed, hint(errno));
    cv::VideoCapture& video = stream_->video;
    errno = 0;
    if (!video.open(name_, cv::CAP_V4L2)) fail(SourceFault::hardware_failed, hint(errno));
    video.set(cv::CAP_PROP_FRAME_WIDTH, width_px_);
    video.set(cv::CAP_PROP_FRAME_HEIGHT, height_px_);
    video.set(cv::CAP_PROP_BUFFERSIZE, 1);  // the newest image, not the oldest queued
    reader_ = std::thread(reader_loop, stream_);
    if (!wait_for_new(kFirstImageTimeout)) {
      close();
      const std::lock_guard lock(stream_->mutex);
      const int error = stream_->error;
      fail(SourceFault::hardware_failed, "delivers no images: " + hint(error));
    }
    if (const cv::Mat first = newest(); first.cols != width_px_ || first.rows != height_px_) {
      close();
      fail(SourceFault::wrong_size,
           "delivers images of " + std::to_string(first.cols) + "x" + std::to_string(first.rows) +
               " px, image_size_px of the rig is " + std::to_string(width_px_) + "x" +
               std::to_string(height_px_));
    }
  }
  ~V4l2ImageSource() override { close(); }

  ReadStatus read(std::int64_t, cv::Mat& bgr) override {
    if (!wait_for_new(kImageTimeout)) {
      const std::lock_guard lock(stream_->mutex);
      last_error_ = name_ + ": " +
                    (stream_->ended ? "stopped delivering: " + hint(stream_->error)
                                    : "no image within 0.5 s");
      return ReadStatus::missing;
    }
    const cv::Mat image = newest();
    if (image.cols != width_px_ || image.rows != height_px_) {
      last_error_ = name_ + ": the size of the images has changed";
      return ReadStatus::missing;
    }
    bgr = image;
    return ReadStatus::image;
  }
  std::int64_t stamp_ns() const override { return stamp_ns_; }
  std::string last_error() const override { return last_error_; }
  bool is_live() const override { return true; }

 private:
  bool wait_for_new(std::chrono::milliseconds limit) {
    std::unique_lock lock(stream_->mutex);
    stream_->changed.wait_for(lock, limit,
                              [&] { return stream_->images > images_read_ || stream_->ended; });
    return stream_->images > images_read_;
  }
  cv::Mat newest() {
    const std::lock_guard lock(stream_->mutex);
    images_read_ = stream_->images;
    stamp_ns_ = stream_->newest_ns;
    return stream_->newest;
  }
  void close() {
    if (!reader_.joinable()) return;
    bool ended;
    {
      std::unique_lock lock(stream_->mutex);
      stream_->stop = true;
      ended = stream_->changed.wait_for(lock, kReaderStopTimeout, [&] { return stream_->ended; });
    }
    // If the driver blocks the reader thread, that thread keeps the shared stream and ends after
    // its next image.
    if (ended)
      reader_.join();
    else
      reader_.detach();
  }

  std::string name_, last_error_;
  int width_px_, height_px_;
  std::shared_ptr<Stream> stream_;
  std::uint64_t images_read_ = 0;
  std::int64_t stamp_ns_ = 0;  // of the image read last
  std::thread reader_;
};

}  // namespace

std::string connected_devices(const fs::path& dev) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(dev / "v4l" / "by-id", error), end; !error && entry != end;
       entry.increment(error))
    names.push_back(entry->path().string());
  for (fs::directory_iterator entry(dev, error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().filename().string().starts_with("video"))
      names.push_back(entry->path().string());
  if (names.empty()) return "no V4L2 device is connected";
  std::sort(names.begin(), names.end());
  std::string text = "connected devices:";
  for (const std::string& name : names) text += " " + name;
  return text;
}

std::unique_ptr<ImageSource> open_v4l2_source(const config::RigCamera& camera,
                                              const config::V4l2Source& source) {
  return std::make_unique<V4l2ImageSource>(camera, source);
}

}  // namespace fivepipe::capture
