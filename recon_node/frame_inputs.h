// The head poses and camera colours of recent frames, which recon_node keeps until it has all maps
// of a frame. The memory is bounded, whatever frame numbers the messages have.
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "common/hull/colour_region.h"
#include "common/pipeline/frames/camera_writers.h"
#include "common/pipeline/frames/recent_frames.h"
#include "common/pipeline/frames/restart_detector.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/view_messages.h"

namespace fivepipe::recon {

class FrameInputs {
 public:
  // The poses and colours of this many frames are kept, more than can be in flight.
  static constexpr std::size_t kMaxFrames = 16;

  // Adds a pose from a writer (bus::Sample::writer()). Drops all earlier poses and colours if
  // capture_node has restarted. Ignores a pose of another process and returns false.
  bool add(messages::FramePose pose, std::uint64_t writer);
  // Adds a camera's colour from a writer. Returns nullptr, or why a colour counts as a drop:
  // `other_writer`, the colour of a process that is not the camera's (frames::CameraWriters), or
  // `repeated_colour`, the earlier one of the same camera and frame, which this one replaces.
  const char* add(messages::CameraColour colour, std::uint64_t writer);

  // Returns nullptr if the frame's pose has not arrived. Valid until the next add().
  const messages::FramePose* pose_of(std::uint64_t frame) const { return poses_.find(frame); }
  // Removes and returns the colours of this frame, by camera.
  std::vector<hull::ColourRegion> take_colours(std::uint64_t frame);
  // Drops the colours of this frame and of all frames with a lower number.
  void drop_colours_up_to(std::uint64_t frame) { colours_.erase_up_to(frame); }
  // Forgets all frames.
  void reset();

 private:
  struct Colour {
    std::uint64_t writer;
    hull::ColourRegion region;
  };
  using ColourOfCamera = std::map<std::size_t, Colour>;
  frames::CameraWriters pose_writers_, colour_writers_;
  frames::RestartDetector restart_detector_{frames::RestartBy::writer};
  frames::RecentFrames<messages::FramePose> poses_{kMaxFrames};
  frames::RecentFrames<ColourOfCamera> colours_{kMaxFrames};
};

}  // namespace fivepipe::recon
