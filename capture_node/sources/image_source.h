// A camera's image source. To add a camera type:
//   1. common/config/capture/capture_config.h: add a struct to CameraSource; has_clock() says
//      whether it is a live camera;
//   2. common/config/capture/source_reader.cpp: read_source() reads it from the deployment file;
//   3. here: add a function that opens it, and implement ImageSource in a file of this folder;
//   4. open_source.cpp calls that function.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture_node/sources/source_error.h"
#include "common/config/capture/capture_config.h"
#include "common/config/rig.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

enum class ReadStatus {
  image,
  missing,  // this frame is lost, unreadable or late; later frames may follow
  end,      // no frame follows
};

// The image of a device is missing if it arrives later than this after the frame is due: ten
// periods of a slow camera (20 Hz).
inline constexpr std::chrono::milliseconds kImageTimeout{500};

// One source per camera. At most one thread at a time may call it.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  // Sets `bgr` to the image of `frame` >= 0: 8-bit BGR of the rig camera's captured size; pictures
  // that were opened for their alpha channel as the file has them, BGRA. Leaves
  // `bgr` unchanged unless the status is `image`. Files: `frame` counts from the first frame to be
  // read. A video decodes all frames up to this one, the last one again costs nothing, a smaller
  // one opens the file again. Devices: the newest image not yet read, without waiting for one;
  // `frame` is ignored.
  virtual ReadStatus read(std::int64_t frame, cv::Mat& bgr) = 0;
  // Waits until `until` for a device's image that is not yet read, and less if it is known that
  // none follows. Returns whether there is one; true for files, which do not wait.
  virtual bool wait_for_image(std::chrono::steady_clock::time_point) { return true; }
  // Returns the number of frames, counted like those of read(), if it is at most `up_to`. A video
  // decodes the frames up to there unless it knows its number.
  virtual std::optional<std::int64_t> length([[maybe_unused]] std::int64_t up_to) {
    return std::nullopt;
  }
  // Returns the time at which the camera took the last image (CLOCK_REALTIME) [ns]; 0 if the source
  // does not know it, as a file.
  virtual std::int64_t stamp_ns() const { return 0; }
  // Returns the number in the file name of the first picture of a sequence; nullopt for others.
  virtual std::optional<std::int64_t> first_number() const { return std::nullopt; }
  // Returns the reason for the last `missing`, for the user; empty if there is none.
  virtual std::string last_error() const { return {}; }
  // Returns true if a missing image may still arrive, as from a camera.
  virtual bool is_live() const { return false; }
  // Tells the threads of a device to end, without waiting for them; the destructor waits. No other
  // call may follow.
  virtual void stop() {}
};

// Opens a video file, an image sequence (printf pattern) or a single picture. Of source.key, only
// an alpha channel matters here: a video has none, which is a fault. Throws SourceError if
// the file is not found, cannot be decoded, has no frame or a size other than camera.source (the
// message names both sizes).
std::unique_ptr<ImageSource> open_file_source(const config::RigCamera& camera,
                                              const config::VideoSource& source);

// Returns the size of the first image of a file, opened like open_file_source(). Throws like it.
cv::Size image_size(const config::RigCamera& camera, const std::string& file);

// Returns at most kMaxBackgroundFrames pictures of the empty scene, evenly spaced over a video, a
// sequence or a single plate image. Throws like open_file_source().
std::vector<cv::Mat> read_background(const config::RigCamera& camera, const std::string& file);
// 64 frames determine the noise to within a tenth (1 / sqrt(2 * 64)), show the colours of a moving
// background, and bound the memory: 400 MB for a camera of 1920x1080.
inline constexpr int kMaxBackgroundFrames = 64;

// Returns the pixels of a picture that are not black. Throws SourceError if the picture cannot be
// decoded or has a size other than camera.source.
hull::ObjectPixels read_region(const config::RigCamera& camera, const std::string& file);

// Opens a V4L2 camera. Throws HardwareMissing if the device does not exist (the message lists the
// connected ones) or delivers no images, and SourceError if its images have another size than
// camera.source.
std::unique_ptr<ImageSource> open_v4l2_source(const config::RigCamera& camera,
                                              const config::V4l2Source& source);

// Opens a GStreamer pipeline, a network camera, or a GenICam camera. Throws SourceError if this
// build lacks the library, if the description of the pipeline is wrong, or if the images have
// another size than camera.source, and HardwareMissing if the camera is missing or delivers no
// images. While the camera is unplugged, read() returns `missing`; the source reconnects by itself.
std::unique_ptr<ImageSource> open_gstreamer_source(const config::RigCamera& camera,
                                                   const config::GstreamerSource& source);
std::unique_ptr<ImageSource> open_rtsp_source(const config::RigCamera& camera,
                                              const config::RtspSource& source);
std::unique_ptr<ImageSource> open_genicam_source(const config::RigCamera& camera,
                                                 const config::GenicamSource& source);

// Returns a text with the V4L2 devices in the folder `dev`: permanent names first, then numbers.
std::string connected_devices(const std::filesystem::path& dev);

}  // namespace fivepipe::capture
