// Reads frame sets from the bus for recon_node and sim_node. Validates and assembles the maps, and
// counts bad and late maps. A process publishes a camera's model (CameraInfo) and its maps. If the
// model differs from the rig, the reader drops that process's maps of the camera and reports a
// diagnostic.
#pragma once
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/node/coverage_joiner.h"
#include "common/pipeline/node/replay_monitor.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

struct FrameSetOptions {
  hull::HullRule rule;  // of the deployment's hull, for diagnostics
  // Sub-pixel silhouettes. A map of a complete set without coverage of its image by its process
  // counts as `missing_coverage` and has an empty outline. A set without any coverage has no
  // outlines.
  bool want_coverage = false;
  std::set<std::string> dispensable;  // see frames::FrameSetAssembler
};
// Returns those of a deployment.
FrameSetOptions frame_set_options(const config::Deployment& deployment);

class FrameSetReader {
 public:
  // bus, rig and status must outlive the reader.
  FrameSetReader(bus::Bus& bus, const config::Rig& rig, NodeStatusReporter& status,
                 FrameSetOptions options = {});

  // Returns the frame sets that are now complete, oldest first. Never waits. Polls `replay`, whose
  // `discard` must call reset() of this reader.
  std::vector<frames::FrameSet> take(ReplayMonitor& replay);
  void reset();  // see FrameSetAssembler

 private:
  // A camera as a process publishes it, and why its model differs from the rig.
  struct Mismatch {
    std::string camera;
    std::optional<bus::ProcessId> process;
    std::string why;
    bool is_of(const std::string& c, const std::optional<bus::ProcessId>& p) const {
      return camera == c && process == p;
    }
  };
  // Remembers at most kMaxMismatches and forgets the oldest.
  static constexpr std::size_t kMaxMismatches = 256;

  static constexpr int kMaxTakes = 16;

  void check_cameras();
  void take_coverages(ReplayMonitor& replay);
  void add_coverage(const bus::Sample<bus::topics::ObjectCoverage>& sample);
  void join_coverage(frames::FrameSet& set);
  void report_mismatch(const std::string& camera);
  void report_lost_cameras();
  bool is_mismatched(const std::string& camera, const std::optional<bus::ProcessId>& process) const;

  const config::Rig& rig_;
  NodeStatusReporter& status_;
  FrameSetOptions options_;
  bus::Reader<bus::topics::CameraInfo> infos_;
  // If coverage is wanted. Exists before the reader of the maps, so that a process that has found
  // the latter has usually found this one.
  std::optional<bus::Reader<bus::topics::ObjectCoverage>> coverages_;
  bus::Reader<bus::topics::ObjectPixelMap> maps_;
  CoverageJoiner coverage_joiner_;
  frames::FrameSetAssembler sets_;
  std::deque<Mismatch> mismatches_;
};

}  // namespace fivepipe::node
