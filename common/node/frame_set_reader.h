// Frame sets from the bus: maps validated, put together, what is bad or late counted; cameras whose published model is not the
// rig's are left out and named. Used by recon_node and sim_node.
#pragma once
#include <set>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/frames/frame_sets.h"
#include "common/node/status.h"

namespace fivepipe {

class FrameSetReader {
 public:
  FrameSetReader(Bus& bus, const Rig& rig, NodeStatusReporter& status);

  // Frame sets that have become complete, oldest first. Never waits.
  std::vector<FrameSet> take();
  void start_anew() { sets_.start_anew(); }  // FrameSets

 private:
  void check_cameras();

  const Rig& rig_;
  NodeStatusReporter& status_;
  Reader<topics::CameraInfo> infos_;
  Reader<topics::ObjectPixelMap> maps_;
  FrameSets sets_;
  std::set<std::string> disagreeing_cameras_;
};

}  // namespace fivepipe
