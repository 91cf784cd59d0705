// Assembles frame sets: the object-pixel maps of one frame, one per camera that gives shape. The
// memory is bounded: new frames displace old ones.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/coverage/coverage_outline.h"
#include "common/hull/hull.h"
#include "common/pipeline/frames/camera_writers.h"
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
  std::uint64_t writer = 0;      // bus::Sample::writer()
};

// Identifies the image of a silhouette.
struct SilhouetteSource {
  std::int64_t capture_stamp_ns;
  std::uint64_t writer;  // as in CameraMap
};

struct FrameSet {
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;                     // of its earliest map
  std::int64_t skew_ns;                              // latest capture stamp minus earliest
  std::int64_t first_received_ns, last_received_ns;  // CLOCK_REALTIME; of its maps
  std::vector<hull::Silhouette> silhouettes;         // in the rig's order
  std::vector<SilhouetteSource> sources;             // of the silhouettes
  // Sub-pixel coverage of the silhouettes; empty if there is none (FrameSetReader).
  std::vector<hull::CoverageOutline> outlines;
  std::vector<std::string> cameras;        // of the silhouettes
  std::vector<std::string> empty_cameras;  // cameras with no object pixel
  // Lost cameras (FrameSetAssembler). The set has no silhouette of them.
  std::vector<std::string> lost_cameras;
};

class FrameSetAssembler {
 public:
  // Maximum number of incomplete sets; a further set displaces the one that was opened first. It
  // exceeds the 8 samples that a reader holds per camera (bus.cpp), because a late reader takes
  // them camera by camera.
  static constexpr std::size_t kMaxIncompleteSets = 12;
  // A camera that sent no map while the others sent this many frames is lost until its next map.
  // The limit counts received frames, because pacing skips frame numbers. It exceeds the samples
  // that a reader holds per camera for the reason above.
  static constexpr std::uint64_t kLostAfterFrames = 15;
  // The assembler remembers this many dropped frames, to count each once.
  static constexpr std::size_t kMaxCountedDrops = 64;

  // Sets are complete without those of the `dispensable` cameras that are lost, but with at least
  // two cameras, if the rig has two: one alone bounds no hull.
  explicit FrameSetAssembler(const config::Rig& rig, const std::set<std::string>& dispensable = {});

  // Adds a map. Returns the frame sets that it completes: none or one, by ascending frame.
  std::vector<FrameSet> add(CameraMap map);

  // Returns the drops since the last call, by reason.
  //   incomplete_set: a frame of which not all maps have arrived in time.
  //   late_map: a frame with a map that arrived after this frame or a newer one was returned. A
  //     frame counts once, as incomplete or as late.
  //   repeated_map: a further map of a camera and frame.
  //   other_writer: a map of a process that is not, or no longer, the camera's (CameraWriters).
  std::map<std::string, std::uint64_t> take_drops();

  // Returns the names of the lost cameras, in the rig's order.
  std::vector<std::string> lost_cameras() const;

  // Forgets earlier frames; call it when a replay starts. Counts incomplete sets as drops.
  void reset();

 private:
  using Incomplete = std::map<std::size_t, CameraMap>;  // by camera
  bool follow_writer(const CameraMap& map);
  void drop_maps_of(std::uint64_t writer);
  void drop(std::uint64_t frame, const char* reason);
  bool count_late(std::uint64_t frame);
  bool is_complete(const Incomplete& set) const;
  bool is_closed(std::uint64_t frame) const;
  void clear();
  bool is_lost(std::size_t camera) const;
  FrameSet finished(std::uint64_t frame, Incomplete set) const;

  config::Rig rig_;
  std::vector<std::size_t> shape_cameras_;
  std::set<std::size_t> dispensable_;
  std::map<std::size_t, std::uint64_t> frames_missed_;  // by camera, since its last map
  RecentFrames<Incomplete> incomplete_{kMaxIncompleteSets};
  RestartDetector restart_detector_{RestartBy::writer};
  std::optional<std::uint64_t> newest_frame_, last_returned_;
  CameraWriters writers_;
  // Closed frames with a map since the last returned set.
  std::vector<std::uint64_t> late_;
  struct Dropped {};
  RecentFrames<Dropped> dropped_{kMaxCountedDrops};  // frames that are counted in drops_
  std::map<std::string, std::uint64_t> drops_;
};

}  // namespace fivepipe::frames
