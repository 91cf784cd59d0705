// The video pipe: per frame, the object pixels and the colour of every camera that this node reads.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture_node/sources/source_error.h"
#include "common/config/deployment.h"
#include "common/hull/colour_region.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

enum class CaptureStatus {
  captured,
  missing,  // no image of this frame; `reason` says why
  ended,    // its file is at its end, and loop is off
};

struct CapturedCamera {
  std::string camera;
  CaptureStatus status = CaptureStatus::captured;
  std::string reason;                        // empty where captured
  std::optional<hull::ObjectPixels> pixels;  // of cameras that give shape; published geometry
  std::optional<hull::ColourRegion>
      colour;  // of cameras that give colour, where it was wanted and the hull may be seen: none
               // where another sees no object
  std::int64_t image_stamp_ns =
      0;  // CLOCK_REALTIME when the image was there; of precomputed sets: when they are handed out
  std::vector<std::string>
      diagnostics;  // what a person should know about this camera's object pixels
  double read_s = 0,
         segment_s = 0;  // time spent on the image, and on making pixels and colour of it
};

class Capture {
 public:
  // What is being done, and how much of it is done (0..1). Called from the constructor, one call at
  // a time, from several threads.
  using Progress = std::function<void(std::string_view what, double fraction)>;

  // Opens every source of the configuration, learns the reference images and segments
  // config.precomputed_frames ahead. Throws SourceError or HardwareMissing naming every camera that
  // can't be had. Cameras of the configuration that the rig lacks are refused where it is loaded.
  // Sets OpenCV to one thread: the cameras are what is done in parallel.
  Capture(const config::Rig& rig, const config::Viewer& viewer, const config::CaptureConfig& config,
          double frame_rate_hz, Progress progress = {});
  ~Capture();

  // The cameras of `frame` >= 0, in the rig's order. Rising frames are cheap, others reopen files.
  // Synthetic images and the head are those of the time frame / frame_rate_hz. With precomputed
  // frames the stored set frame % precomputed_frames. With loop, all sources start over together
  // when the first of them ends.
  std::vector<CapturedCamera> capture(std::int64_t frame, bool want_colour);

  // Some camera's file has ended: no complete set follows.
  bool ended() const { return ended_; }
  // Names of the cameras that it reads, in the rig's order.
  std::vector<std::string> cameras() const;

 private:
  struct Channel;
  struct RawCapture;
  // index: of the image in its source; frame: of the head's time.
  RawCapture raw_capture(Channel& channel, std::int64_t frame, std::int64_t index,
                         bool want_colour) const;
  void add_colours(std::int64_t frame, std::vector<RawCapture>& raw_captures) const;
  std::vector<CapturedCamera> capture_live(std::int64_t frame, bool want_colour);
  void learn(Channel& channel) const;

  config::Rig rig_;
  config::Viewer viewer_;
  config::CaptureConfig config_;
  double frame_rate_hz_;
  std::vector<std::unique_ptr<Channel>> channels_;
  std::vector<std::vector<CapturedCamera>> precomputed_;  // by frame, by camera
  std::int64_t round_start_ = 0;  // frame at which the files started over last
  bool ended_ = false;
};

// Frames of the empty synthetic room that the reference image is learnt from.
inline constexpr int kSyntheticBackgroundFrames = 24;

}  // namespace fivepipe::capture
