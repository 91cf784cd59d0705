// Settings of the capture node: where each camera's images come from, and how they are segmented.
//
// To add a camera type, add its settings to CameraSource below and follow the list in
// capture_node/sources/image_source.h.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "common/hull/hull.h"

namespace fivepipe::config {

// Rendered images: see SyntheticWorld.
struct SyntheticSource {};

// Objects in front of a screen of one colour: a pixel with the colour of the screen is none.
struct ChromaKey {
  std::array<double, 3> rgb = {0, 1, 0};  // of the screen, 0 to 1
  double max_angle_deg = 30;  // of its hue, in the plane of the chroma components Cb and Cr
  double min_chroma = 0.3;    // fraction of the screen's chroma, which its shadows reduce
};

// Bounds the memory while a background is learned: 800 MB for a camera of 1920x1080.
inline constexpr int kMaxLearningImages = 128;

// How the object pixels of a camera are found.
struct LearnedBackground {
  std::string file;  // the empty scene: video, sequence or single picture; empty: the first images
  int frames = 30;   // number of these images, at most kMaxLearningImages
};
struct MatteFile {
  std::string file;  // video or sequence of masks, frame by frame: from half white on, object
};
struct AlphaChannel {};  // of the pictures: from half opaque on, object
using ObjectKey = std::variant<LearnedBackground, MatteFile, AlphaChannel, ChromaKey>;

// A video file, or an image sequence by a printf pattern (frame_%04d.png).
struct VideoSource {
  std::string file;
  ObjectKey key;
  int first_frame = 0;  // index in the file of the frame to read first, also in a matte
};

// The least rate of a live camera, because capture_node reports an image as missing if none
// arrives within 0.5 s (kImageTimeout in capture_node/sources/image_source.h).
inline constexpr double kMinCameraRate_hz = 3, kMaxExposure_us = 333'000;

// A V4L2 camera.
struct V4l2Source {
  std::string device;       // index, or path; /dev/v4l/by-id/... keeps its name across reboots
  ObjectKey key;            // a learned background or a chroma key
  std::string format = {};  // FOURCC such as MJPG; empty: an uncompressed one, if there is one
  std::optional<double> rate_hz = {};  // absent: 30
};

// Any GStreamer pipeline that delivers video.
struct GstreamerSource {
  std::string pipeline;  // as for gst-launch-1.0, without a sink
  ObjectKey key;         // a learned background or a chroma key
};

// A network camera.
struct RtspSource {
  std::string url;  // rtsp:// or rtsps://, without quotes and spaces
  ObjectKey key;    // a learned background or a chroma key
};

// A GenICam camera: GigE Vision or USB3 Vision.
struct GenicamSource {
  std::string camera;                          // name, serial number, or address
  std::optional<double> exposure_us, gain_db;  // absent: as the camera is set
  ObjectKey key;                               // a learned background or a chroma key
};

// The type of a camera.
using CameraSource = std::variant<SyntheticSource, VideoSource, V4l2Source, GstreamerSource,
                                  RtspSource, GenicamSource>;

// Returns true for cameras and streams, which deliver images at their own time, false for files and
// synthetic images, which wait.
inline bool has_clock(const CameraSource& source) {
  return !std::holds_alternative<VideoSource>(source) &&
         !std::holds_alternative<SyntheticSource>(source);
}

// Returns how the object pixels of a camera are found. A synthetic camera learns its background.
inline ObjectKey key_of(const CameraSource& source) {
  return std::visit(
      [](const auto& of_type) -> ObjectKey {
        if constexpr (requires { of_type.key; })
          return of_type.key;
        else
          return {};
      },
      source);
}

// The actions of the person that synthetic cameras see: capture_node/synthetic/actors/actors.h.
enum class SyntheticActor {
  hand_with_pipe,
  parting_hands,
  hand_with_tray,
  pushing_hand,
  catching_hand,
  pipe_task,
  reaching_arm,
  reaching_and_leaning
};
// Returns true if the actor's hand can have any length.
inline bool has_hand_length(SyntheticActor actor) {
  return actor == SyntheticActor::pipe_task || actor == SyntheticActor::reaching_arm ||
         actor == SyntheticActor::reaching_and_leaning;
}

// What the person of actor pipe_task uses. tongs: the cord is flexible, and they hold its plug.
enum class SyntheticTool { none, tongs };

// The real objects that synthetic cameras see. They repeat their motion exactly.
struct SyntheticWorld {
  SyntheticActor actor = SyntheticActor::hand_with_pipe;
  std::uint64_t seed = 1;       // of textures and noise; hand_with_pipe: of the fingers' phase
  double period_s = 4.0;        // of the motion
  double hand_length_m = 0.19;  // from the wrist to the tip of the middle finger
  SyntheticTool tool = SyntheticTool::none;
  double noise_sigma_levels = 2.0;  // sensor noise, grey levels of 255
  bool cast_shadow = true;
  int supersampling = 1;  // rays along each axis of a pixel; 1: no pixel is covered in part
  // Cameras fixed in the world render one period before the start. This takes at most 1 MB per
  // image, and read() then only copies images.
  bool prerender = false;
};

// Image segmentation (paper, section 3.1); the steps are in
// capture_node/segmentation/segmentation.h.
struct SegmentationConfig {
  // A pixel differs from the background if a channel is farther from its mean than
  //   max(floor, min(ceiling, sigmas * measured noise)) + jitter * gradient.
  double threshold_sigmas = 4;
  double threshold_floor_levels = 8, threshold_ceiling_levels = 16;  // grey levels of 255
  double jitter_px = 0.2;  // movement of the camera against its background
  // A pixel that differs this many times as far is certain; a region without one is no object.
  double hysteresis = 2;
  int moving_boxes = 4;  // colours of a pixel whose background moves; 0: one for each pixel
  bool gain_compensation = true;  // for changes of the brightness of the whole image
  // A darker pixel is shadow if its brightness is at least this fraction of the background's and it
  // keeps the background's colour; 1: no pixel is shadow.
  double shadow_min_brightness = 0.5;
  // Largest angle between the colours of a shadow and of its background.
  double shadow_tint_degrees = 2;
  int min_object_px = 30;  // smaller regions are no objects
  int max_hole_px = 50;    // holes up to this area are filled
  int opening_px = 0;      // radius of the morphological opening; 0: none
  int closing_px = 0;      // radius of the morphological closing; 0: none
  // Every pixel that differs is object: skips all steps that can drop one; see
  // capture_node/segmentation/segmentation.h.
  bool conservative = false;
  // Time constant [s] with which the background follows slow changes: of the whole image's
  // brightness everywhere, others away from objects; 0: never.
  double adaptation_s = 0;
  // Object pixels are only searched where the camera sees this world box; without it, everywhere.
  std::optional<Eigen::AlignedBox3d> volume_m;
  // Picture of a camera's captured size: object pixels are only searched where it is not black.
  std::map<std::string, std::string> regions;  // by camera
};

// What happens to a frame for which a camera that gives shape has no image.
//   drop:  the frame has no map of this camera, so that its set stays incomplete.
//   wait:  capture_node waits until the camera delivers again. Files do not.
//   go_on: every pixel of this camera is an object pixel, so that the camera limits the hull only
//          by the border of its image.
enum class LostCamera { drop, wait, go_on };

struct CaptureConfig {
  std::map<std::string, CameraSource> sources;  // by name of the camera that this node reads
  SyntheticWorld synthetic;
  SegmentationConfig segmentation;                            // of all other cameras
  std::map<std::string, SegmentationConfig> segmentation_of;  // by camera
  const SegmentationConfig& segmentation_for(const std::string& camera) const {
    const auto own = segmentation_of.find(camera);
    return own == segmentation_of.end() ? segmentation : own->second;
  }
  LostCamera lost_camera = LostCamera::drop;
  bool loop = true;  // files begin again together after the shortest one; frame numbers continue
  int max_frames_in_flight = 3;  // published and not yet composited; 0: no pacing
  // Captures this many frames before the start and publishes them repeatedly; 0: live.
  int precomputed_frames = 0;
  hull::HullRule hull_rule = {};  // of the deployment: which points of the hull need a colour
  bool coverage = false;          // of the deployment: sub-pixel silhouettes
};

// Returns the configuration for work without a clock: a file ends instead of starting again, so
// that no frame is a second time one of its first, and every frame is captured.
inline CaptureConfig without_clock(CaptureConfig config) {
  config.loop = false;
  config.precomputed_frames = 0;
  return config;
}

}  // namespace fivepipe::config
