// Settings of the capture node: where each camera's images come from, and how they are segmented.
//
// To add a camera type, add its settings to CameraSource below and follow the list in
// capture_node/sources/image_source.h.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <variant>

namespace fivepipe::config {

// Rendered images: see SyntheticWorld.
struct SyntheticSource {};

// A video file, or an image sequence by a printf pattern (frame_%04d.png).
struct VideoSource {
  std::string file;
  std::string background;  // empty scene for the reference image: video, sequence or single picture
  int first_frame = 0;     // index in the file of the frame to read first
};

// A V4L2 camera.
struct V4l2Source {
  std::string device;          // index, or path; /dev/v4l/by-id/... keeps its name across reboots
  std::string background;      // picture of the empty scene; empty: learn from the first images
  int background_frames = 30;  // number of these images
};

// The type of a camera.
using CameraSource = std::variant<SyntheticSource, VideoSource, V4l2Source>;

// The actions of the person that synthetic cameras see: capture_node/synthetic/actors/actors.h.
enum class SyntheticActor {
  hand_with_pipe,
  parting_hands,
  hand_with_tray,
  pushing_hand,
  catching_hand
};

// The real objects that synthetic cameras see. They repeat their motion exactly.
struct SyntheticWorld {
  SyntheticActor actor = SyntheticActor::hand_with_pipe;
  std::uint64_t seed = 1;           // of textures and noise; hand_with_pipe: of the fingers' phase
  double period_s = 4.0;            // of the motion
  double noise_sigma_levels = 2.0;  // sensor noise, grey levels of 255
  bool cast_shadow = true;
  // Cameras fixed in the world render one period before the start. This takes at most 1 MB per
  // image, and read() then only copies images.
  bool prerender = false;
};

// Image segmentation (paper, section 3.1). A pixel is an object pixel if it differs from the
// reference image by more than max(threshold_floor_levels, threshold_sigmas * its measured noise).
struct SegmentationConfig {
  double threshold_sigmas = 6.0;
  double threshold_floor_levels = 12.0;  // grey levels of 255
  // A darker pixel is shadow if its brightness is at least this fraction of the reference's and it
  // keeps the reference's colour; 1: no pixel is shadow.
  double shadow_min_brightness = 0.5;
  int opening_px = 1;  // radius of the morphological opening that removes specks; 0: none
  int closing_px = 0;  // radius of the morphological closing that fills holes; 0: none
};

struct CaptureConfig {
  std::map<std::string, CameraSource> sources;  // by name of the camera that this node reads
  SyntheticWorld synthetic;
  SegmentationConfig segmentation;
  bool loop = true;              // files restart at their end; frame numbers continue
  int max_frames_in_flight = 3;  // published and not yet composited; 0: no pacing
  // Captures this many frames before the start and publishes them repeatedly; 0: live.
  int precomputed_frames = 0;
};

}  // namespace fivepipe::config
