// Reads frame sets from the bus for recon_node and sim_node. Validates and assembles the maps, and
// counts bad and late maps. Drops the maps of a camera whose model, as the process publishes it
// that also sends the maps, differs from the rig, and reports it as a diagnostic.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/containers/bounded_map.h"
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
  // Remembers at most kMaxMismatches cameras of processes and forgets the oldest.
  static constexpr std::size_t kMaxMismatches = 256;
  using CameraOfProcess = std::pair<std::string, std::optional<bus::ProcessId>>;

  const config::Rig& rig_;
  NodeStatusReporter& status_;
  bus::Reader<bus::topics::CameraInfo> infos_;
  bus::Reader<bus::topics::ObjectPixelMap> maps_;
  frames::FrameSetAssembler sets_;
  base::BoundedMap<CameraOfProcess, std::monostate> mismatched_{kMaxMismatches};
};

}  // namespace fivepipe::node
