// Frame sets from the bus: maps validated, put together, what is bad or late counted; cameras whose
// published model is not the rig's are left out and named. Used by recon_node and sim_node.
#pragma once
#include <set>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

class FrameSetReader {
 public:
  FrameSetReader(bus::Bus& bus, const config::Rig& rig, NodeStatusReporter& status);

  // Frame sets that have become complete, oldest first. Never waits.
  std::vector<frames::FrameSet> take();
  void reset() { sets_.reset(); }  // FrameSetAssembler

 private:
  void check_cameras();

  const config::Rig& rig_;
  NodeStatusReporter& status_;
  bus::Reader<bus::topics::CameraInfo> infos_;
  bus::Reader<bus::topics::ObjectPixelMap> maps_;
  frames::FrameSetAssembler sets_;
  std::set<std::string> mismatched_cameras_;
};

}  // namespace fivepipe::node
