// Reads frame sets from the bus for recon_node and sim_node. Validates and assembles the maps, and
// counts bad and late maps. Drops the maps of a camera whose published model differs from the rig
// and reports it as a diagnostic.
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
  // The arguments must outlive the reader.
  FrameSetReader(bus::Bus& bus, const config::Rig& rig, NodeStatusReporter& status);

  // Returns the frame sets that are now complete, oldest first. Never waits.
  std::vector<frames::FrameSet> take();
  void reset() { sets_.reset(); }  // see FrameSetAssembler

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
