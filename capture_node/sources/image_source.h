// Where a camera's images come from. One source per camera; a source is used by one thread at a
// time.
#pragma once
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "capture_node/sources/source_error.h"
#include "common/config/deployment.h"

namespace fivepipe::capture {

enum class ReadStatus {
  image,
  missing,  // this frame can't be had (lost, unreadable, late); others may follow
  end,      // no frame follows
};

class ImageSource {
 public:
  virtual ~ImageSource() = default;
  // bgr becomes the image of frame >= 0: 8-bit BGR of the rig camera's captured size. Untouched
  // unless the status is `image`. Files: frame is the index counted from their first frame; asking
  // in rising order is cheap, going back reopens them. Devices: the newest image not yet read,
  // whatever the index; waits for it a bounded time.
  virtual ReadStatus read(std::int64_t frame, cv::Mat& bgr) = 0;
  // What happened with the last `missing`, for a person; empty where there is nothing to say.
  virtual std::string last_error() const { return {}; }
};

// A video file, an image sequence by printf pattern, or a single picture. Throws SourceError: not
// found, not decodable, no frames, or another size than camera.source (both are named).
std::unique_ptr<ImageSource> open_file_source(const config::RigCamera& camera,
                                              const config::VideoSource& source);

// At most kMaxBackgroundFrames pictures of the empty scene, spread evenly over a video, a sequence
// or a single plate image. Throws like open_file_source.
std::vector<cv::Mat> read_background(const config::RigCamera& camera, const std::string& file);
inline constexpr int kMaxBackgroundFrames =
    32;  // the noise of 32 is known to an eighth; their memory is bounded

// Throws HardwareMissing naming the device and listing those that are there.
std::unique_ptr<ImageSource> open_v4l2_source(const config::RigCamera& camera,
                                              const config::V4l2Source& source);

}  // namespace fivepipe::capture
