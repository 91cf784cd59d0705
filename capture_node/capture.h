// Captures, for each frame, the object pixels and the colour of every camera that this node reads.
// Uses no DDS; video_pipe.cpp publishes the results.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture_node/captured_camera.h"
#include "capture_node/segmentation/segmentation.h"
#include "capture_node/sources/source_error.h"
#include "common/base/worker_pool.h"
#include "common/config/capture/capture_config.h"
#include "common/config/rig.h"
#include "common/config/view/viewer.h"

namespace fivepipe::capture {

class Capture {
 public:
  // Receives the name of the current step and the completed fraction of it (0 to 1). The
  // constructor calls it from several threads, one call at a time.
  using Progress = std::function<void(std::string_view what, double fraction)>;

  // Opens every source of the configuration, learns the backgrounds and computes the first
  // config.precomputed_frames frames. Throws SourceError or HardwareMissing that lists every camera
  // whose source cannot be used. load_deployment() has already rejected cameras that the rig lacks.
  // Sets OpenCV to one thread, because Capture processes cameras in parallel. Cameras without
  // object pixels of their own get the colours that the viewer or a spectator can see.
  Capture(const config::Rig& rig, const config::Viewer& viewer, const config::CaptureConfig& config,
          double frame_rate_hz, const Progress& progress = {},
          std::vector<config::Viewer> spectators = {});
  ~Capture();

  // Returns the cameras of `frame` >= 0, in the rig's order. A video decodes all frames up to this
  // one, a smaller `frame` opens the files again. Synthetic images and the head pose are those at
  // frame / frame_rate_hz [s]. With precomputed frames, returns the stored set `frame` modulo their
  // number. With config.loop, all files begin again together after the shortest one: frame n shows
  // the images n modulo its length. stamp_ns: time of images whose source has no clock
  // (CLOCK_REALTIME); 0: the time at which they are read.
  std::vector<CapturedCamera> capture(std::int64_t frame, bool want_colour,
                                      std::int64_t stamp_ns = 0);

  // Receives the captured image of a camera that gives shape, and what segmentation found in it.
  // Each capture() that does not return precomputed frames calls it, from several threads, once for
  // each camera; again if it captures the frame again, because a file has ended or it has waited
  // for a lost camera.
  using Observer =
      std::function<void(const config::RigCamera&, const cv::Mat& image_bgr, const Segmentation&)>;
  void set_observer(Observer observer) { observer_ = std::move(observer); }

  // With config.lost_camera `wait`, each attempt to read a lost camera again calls this function;
  // false ends the wait. reason: why there is no image. Without it, nothing waits.
  using GoOnWaiting = std::function<bool(const std::string& camera, const std::string& reason)>;
  void set_go_on_waiting(GoOnWaiting go_on) { go_on_waiting_ = std::move(go_on); }

  // Returns true if the file or stream of a camera has ended: no complete set follows.
  bool ended() const { return ended_; }

 private:
  struct Channel;
  struct RawCapture;
  // `index` selects the image in its source, `frame` the time of the head pose. now_ns: stamp of
  // images whose source has no clock; stamp_ns: as in capture().
  std::vector<RawCapture> capture_all(std::int64_t frame, std::int64_t index, std::int64_t stamp_ns,
                                      bool want_colour);
  static bool is_read(const Channel& channel, bool want_colour);
  void wait_for_images(bool want_colour) const;
  static void read_image(Channel& channel, std::int64_t index, RawCapture& raw_capture);
  void segment(Channel& channel, std::int64_t frame, std::int64_t index, std::int64_t now_ns,
               RawCapture& raw_capture) const;
  std::optional<std::int64_t> shortest_length(std::int64_t up_to);
  std::size_t cameras_of_others() const;
  void go_on_without_lost(std::vector<RawCapture>& raw_captures) const;
  bool waited_for_lost(const std::vector<RawCapture>& raw_captures, std::int64_t index);
  void add_colours(std::int64_t frame, std::vector<RawCapture>& raw_captures);
  std::vector<CapturedCamera> capture_live(std::int64_t frame, bool want_colour,
                                           std::int64_t stamp_ns);
  void open_channels(const Progress& progress);
  void prepare(Channel& channel) const;
  void precompute(const Progress& progress);

  config::Rig rig_;
  config::Viewer viewer_;
  std::vector<config::Viewer> colour_viewers_;  // spectators and the viewer
  config::CaptureConfig config_;
  double frame_rate_hz_;
  Observer observer_;
  GoOnWaiting go_on_waiting_;
  base::WorkerPool pool_;
  std::vector<std::unique_ptr<Channel>> channels_;
  std::vector<std::vector<CapturedCamera>> precomputed_;  // by frame, by camera
  // Number of frames of the shortest file, after which all files begin again; known at its end.
  std::optional<std::int64_t> loop_length_;
  bool ended_ = false;
};

}  // namespace fivepipe::capture
