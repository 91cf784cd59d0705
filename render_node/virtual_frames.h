// The simulation's word on each frame: where virtual objects are and which collide. Pure; bounded;
// newest wins.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/pipeline/frames/restart_detector.h"
#include "render_node/renderer.h"

namespace fivepipe::render {

struct VirtualFrame {
  std::vector<ObjectPose> poses;
  std::set<std::string> colliding;
  bool complete = false;  // its state has come; collisions are sent before it
};

class VirtualFrames {
 public:
  static constexpr std::size_t kMaxFrames = 16;

  void add_collision(std::uint64_t frame, std::int64_t capture_stamp_ns, const std::string& object);
  void add_state(std::uint64_t frame, std::int64_t capture_stamp_ns, std::vector<ObjectPose> poses);

  bool has(std::uint64_t frame) const;
  // The newest complete one at or before this frame, else the oldest complete one; nothing where no
  // state has come yet.
  const VirtualFrame* best_for(std::uint64_t frame) const;

 private:
  VirtualFrame& at(std::uint64_t frame, std::int64_t capture_stamp_ns);
  frames::RestartDetector restart_detector_;
  std::map<std::uint64_t, VirtualFrame> frames_;
  VirtualFrame too_old_;
};

}  // namespace fivepipe::render
