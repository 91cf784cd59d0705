// Puts the maps of one frame together: one per camera that gives shape. Pure; bounded; newest wins.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/hull.h"
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
  std::int64_t capture_stamp_ns;                     // the earliest of its maps
  std::int64_t skew_ns;                              // latest less earliest
  std::int64_t first_received_ns, last_received_ns;  // of its maps
  std::vector<hull::Silhouette> silhouettes;         // in the rig's order
  std::vector<std::string> cameras;                  // whose they are
  std::vector<std::string> empty_cameras;  // without one object pixel: why the hull is empty
  std::vector<std::string> lost_cameras;   // left out: nothing came from them for kLostAfterFrames
};

class FrameSetAssembler {
 public:
  // Sets kept while their maps come in; a set older than these is given up. More than a reader
  // holds of one camera (topics.h: 8), as maps that waited are taken camera by camera.
  static constexpr std::size_t kMaxIncompleteSets = 12;
  // A camera of which nothing came while this many frames came from others leaves the set, which is
  // then complete without it; it is back with its next map. Counted in frames that came, not by
  // their numbers, which pacing makes jump; and more than a reader can hold of one camera, as maps
  // that waited are taken camera by camera.
  static constexpr std::uint64_t kLostAfterFrames = 15;

  explicit FrameSetAssembler(const config::Rig& rig);

  // What the map completes: nothing or one frame set, in rising order of frames.
  std::vector<FrameSet> add(CameraMap map);

  // Counted since the last call, by reason: late_map (its frame was handed out or given up, or it
  // was captured long before the others of its number), repeated_map, incomplete_set.
  std::map<std::string, std::uint64_t> take_drops();

  // Whatever comes next is of another time: what is incomplete is given up.
  void reset();

 private:
  struct Incomplete {
    std::map<std::size_t, CameraMap> map_of_camera;
  };
  bool is_complete(const Incomplete& set) const;
  void clear();
  FrameSet finished(std::uint64_t frame, Incomplete set) const;

  config::Rig rig_;
  std::vector<std::size_t> shape_cameras_;
  std::map<std::size_t, std::uint64_t> frames_missed_;  // by camera, since its last map
  std::map<std::uint64_t, Incomplete> incomplete_;
  RestartDetector restart_detector_;
  std::optional<std::uint64_t> newest_frame_, last_closed_;  // closed: handed out or given up
  std::map<std::string, std::uint64_t> drops_;
};

}  // namespace fivepipe::frames
