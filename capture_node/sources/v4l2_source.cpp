#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <opencv2/videoio.hpp>

#include "capture_node/sources/image_source.h"
#include "capture_node/sources/live_source.h"
#include "common/base/realtime.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

std::string path_of(const std::string& device) {
  const bool index = !device.empty() && device.find_first_not_of("0123456789") == std::string::npos;
  return index ? "/dev/video" + device : device;
}

// Explains the errno of a device that delivers no images, with the fix.
std::string hint(int error) {
  if (error == ENOSPC)
    return "not enough USB bandwidth (ENOSPC): connect the cameras to separate USB controllers, "
           "or request format: MJPG, a lower rate_hz, or a smaller image (image_size_px in the "
           "rig)";
  if (error == EBUSY) return "another program uses the device";
  if (error == EACCES || error == EPERM)
    return "no permission to open it: add the user to the group video";
  if (error == 0) return "the device does not respond as a camera";
  return std::strerror(error);
}

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

class V4l2Stream final : public ImageStream {
 public:
  V4l2Stream(std::string path, config::V4l2Source source, int width_px, int height_px)
      : path_(std::move(path)),
        source_(std::move(source)),
        width_px_(width_px),
        height_px_(height_px) {}

  std::optional<StreamFault> open() override {
    video_.release();
    if (std::error_code error; !fs::is_character_file(path_, error))
      return StreamFault{SourceFault::hardware_missing,
                         "no such camera; " + connected_devices("/dev")};
    if (const int descriptor = ::open(path_.c_str(), O_RDWR | O_NONBLOCK); descriptor >= 0)
      ::close(descriptor);
    else
      return StreamFault{SourceFault::hardware_failed, hint(errno)};
    errno = 0;
    if (!video_.open(path_, cv::CAP_V4L2))
      return StreamFault{SourceFault::hardware_failed, hint(errno)};
    // The sizes and rates of a camera depend on its format.
    const std::string& f = source_.format;
    const int fourcc = f.empty() ? 0 : cv::VideoWriter::fourcc(f[0], f[1], f[2], f[3]);
    if (fourcc) video_.set(cv::CAP_PROP_FOURCC, fourcc);
    video_.set(cv::CAP_PROP_FRAME_WIDTH, width_px_);
    video_.set(cv::CAP_PROP_FRAME_HEIGHT, height_px_);
    video_.set(cv::CAP_PROP_BUFFERSIZE, 1);  // the newest image, not the oldest queued
    if (source_.rate_hz) video_.set(cv::CAP_PROP_FPS, *source_.rate_hz);
    // OpenCV takes another format if the camera lacks this one.
    if (fourcc && int(video_.get(cv::CAP_PROP_FOURCC)) != fourcc)
      return StreamFault{SourceFault::hardware_failed,
                         "refuses the format " + f + "; `fivepipe cameras` lists its formats"};
    return {};
  }

  NextImage next() override {
    NextImage next;
    errno = 0;
    const bool got = video_.read(next.bgr) && !next.bgr.empty();
    const int error = errno;
    if (!got) return {NextImage::Status::lost, {}, 0, hint(error)};
    next.status = NextImage::Status::image;
    next.taken_ns = taken_ns(video_);
    return next;
  }

 private:
  std::string path_;
  config::V4l2Source source_;
  int width_px_, height_px_;
  cv::VideoCapture video_;
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
  const std::string name = path_of(source.device);
  // USB cameras need seconds to start their stream.
  return open_live_source(
      camera, {.name = name, .first_image_timeout = 5s},
      std::make_unique<V4l2Stream>(name, source, camera.source.width_px, camera.source.height_px));
}

}  // namespace fivepipe::capture
