// Puts the maps of one frame together: one per camera that gives shape. Pure; bounded; newest wins.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/hull/hull.h"
#include "common/messages/camera_messages.h"

namespace fivepipe {

struct FrameSet {
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;       // the earliest of its maps
  std::int64_t skew_ns;                // latest less earliest
  std::vector<Silhouette> silhouettes;  // in the rig's order
  std::vector<std::string> empty_cameras;  // without one object pixel: why the hull is empty
  std::vector<std::string> lost_cameras;   // left out: nothing came from them for kLostAfterFrames
};

class FrameSets {
 public:
  // Sets kept while their maps come in; a set older than these is given up. More than capture's frames in flight.
  static constexpr std::size_t kMaxIncomplete = 6;
  // A camera that is this many frames behind the others leaves the set, which is then complete without it; it is back
  // with its next map.
  static constexpr std::uint64_t kLostAfterFrames = 15;

  explicit FrameSets(const Rig& rig);

  // What the map completes: nothing or one frame set, in rising order of frames.
  std::vector<FrameSet> add(CameraMap map);

  // Counted since the last call, by reason: late_map (its frame was handed out or given up), repeated_map, incomplete_set.
  std::map<std::string, std::uint64_t> take_drops();

 private:
  struct Incomplete {
    std::map<std::size_t, CameraMap> map_of_camera;
  };
  bool is_lost(std::size_t camera, std::uint64_t at_frame) const;
  bool is_complete(std::uint64_t frame, const Incomplete& set) const;
  FrameSet finished(std::uint64_t frame, Incomplete set) const;

  Rig rig_;
  std::vector<std::size_t> shape_cameras_;
  std::map<std::size_t, std::uint64_t> newest_frame_of_camera_;
  std::map<std::uint64_t, Incomplete> incomplete_;
  std::optional<std::uint64_t> first_frame_, last_handed_out_;
  std::map<std::string, std::uint64_t> drops_;
};

}  // namespace fivepipe
