// Assembles frame sets: the object-pixel maps of one frame, one per camera that gives shape. The
// memory is bounded: new frames displace old ones.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/hull.h"
#include "common/pipeline/frames/recent_frames.h"
#include "common/pipeline/frames/restart_detector.h"

namespace fivepipe::frames {

// One camera's object pixels of one frame.
struct CameraMap {
  std::size_t camera;  // index into rig.cameras
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::ObjectPixels pixels;
  std::int64_t received_ns = 0;  // CLOCK_REALTIME, by this process
};

struct FrameSet {
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;                     // of its earliest map
  std::int64_t skew_ns;                              // latest capture stamp minus earliest
  std::int64_t first_received_ns, last_received_ns;  // CLOCK_REALTIME; of its maps
  std::vector<hull::Silhouette> silhouettes;         // in the rig's order
  std::vector<std::string> cameras;                  // of the silhouettes
  std::vector<std::string> empty_cameras;  // cameras with no object pixel: the hull is empty
  // Cameras without a map for kLostAfterFrames. The set has no silhouette of them.
  std::vector<std::string> lost_cameras;
};

class FrameSetAssembler {
 public:
  // Maximum number of incomplete sets; a further set displaces the one that was opened first. It
  // exceeds the 8 samples that a reader holds per camera (bus.cpp), because a late reader takes
  // them camera by camera.
  static constexpr std::size_t kMaxIncompleteSets = 12;
  // A camera that sent no map while the others sent this many frames is lost: sets are complete
  // without it until its next map. The limit counts received frames, because pacing skips frame
  // numbers. It exceeds the samples that a reader holds per camera for the reason above.
  static constexpr std::uint64_t kLostAfterFrames = 15;

  explicit FrameSetAssembler(const config::Rig& rig);

  // Adds a map. Returns the frame sets that it completes: none or one, by ascending frame.
  std::vector<FrameSet> add(CameraMap map);

  // Returns the drops since the last call, by reason. late_map: the frame was already returned or
  // dropped, or the map was captured long before the others of its frame number. Other
  // reasons: repeated_map, incomplete_set.
  std::map<std::string, std::uint64_t> take_drops();

  // Forgets earlier frames; call it when a replay starts. Counts incomplete sets as drops.
  void reset();

 private:
  using Incomplete = std::map<std::size_t, CameraMap>;  // by camera
  bool is_complete(const Incomplete& set) const;
  bool is_closed(std::uint64_t frame) const;
  void clear();
  FrameSet finished(std::uint64_t frame, Incomplete set) const;

  config::Rig rig_;
  std::vector<std::size_t> shape_cameras_;
  std::map<std::size_t, std::uint64_t> frames_missed_;  // by camera, since its last map
  RecentFrames<Incomplete> incomplete_{kMaxIncompleteSets};
  RestartDetector restart_detector_;
  std::optional<std::uint64_t> newest_frame_, last_returned_;
  std::map<std::string, std::uint64_t> drops_;
};

}  // namespace fivepipe::frames
