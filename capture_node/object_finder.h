// Finds the object pixels of one camera in the way that its configuration states: a learned
// background, masks, an alpha channel, or the colour of a screen.
#pragma once
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "capture_node/segmentation/segmentation.h"
#include "capture_node/sources/image_source.h"
#include "common/config/capture/capture_config.h"
#include "common/config/rig.h"

namespace fivepipe::capture {

// At most one thread at a time may call it.
class ObjectFinder {
 public:
  virtual ~ObjectFinder() = default;
  // Finds the object pixels of image `index` of the camera's source: 8-bit, the captured size, BGR
  // or BGRA as the source delivers it. Without object pixels, `reason` says why, for the user, and
  // `ended` whether no further image can have any.
  struct Found {
    std::optional<Segmentation> segmentation;
    std::string reason;
    bool ended = false;
    // All object pixels of the image are outside `volume_m` and `regions` of segmentation.
    bool all_outside = false;
  };
  virtual Found find(const cv::Mat& image, std::int64_t index) = 0;
  // Returns the number of images that can have object pixels, if it is at most `up_to`; see
  // ImageSource::length().
  virtual std::optional<std::int64_t> length([[maybe_unused]] std::int64_t up_to) {
    return std::nullopt;
  }
};

// Opens what the camera's configuration names, and learns the background if it has one; the first
// images of `source` are then the empty scene, unless the configuration names a file, or the source
// is synthetic. Throws SourceError or HardwareMissing. config.sources has the camera.
std::unique_ptr<ObjectFinder> open_object_finder(const config::RigCamera& camera,
                                                 const config::CaptureConfig& config,
                                                 ImageSource& source, double frame_rate_hz);

// Number of frames of the empty synthetic room from which the background is learned.
inline constexpr int kSyntheticBackgroundFrames = 24;

}  // namespace fivepipe::capture
