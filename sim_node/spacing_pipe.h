// Moves objects as SpacingRequests ask, or during a replay as the recording's ObjectSpacings state.
#pragma once
#include <deque>
#include <optional>
#include <vector>

#include "common/pipeline/node/replay_monitor.h"
#include "common/pipeline/node/run_node.h"
#include "sim_node/messages_spacing.h"
#include "sim_node/simulation/simulation.h"

namespace fivepipe::sim {

// Reads and writes nothing if no object of the scene has a spacing.
class SpacingPipe {
 public:
  // Begins with NodeContext::spacings_m; drops and counts those that the scene does not permit.
  explicit SpacingPipe(node::NodeContext& node);

  // Drops and counts invalid messages. During a replay, uses only recorded spacings that arrived
  // after its session; otherwise, only requests.
  void take(node::ReplayMonitor& replay);
  // Moves the simulation's objects to their spacings in this frame. Call before it is simulated.
  void apply(std::int64_t capture_stamp_ns, Simulation& simulation);
  // Sends the spacings that this frame is the first to have; none during a replay.
  void publish(std::uint64_t frame, std::int64_t capture_stamp_ns, bool replaying);
  // Returns to the scene's spacings, for a new simulation in a replay.
  void reset();

 private:
  struct State {
    double spacing_m = 0;
    bool requested = false;
    std::optional<double> published_m = {};
  };
  template <class Topic>
  void take_from(bus::Reader<Topic>& reader, node::ReplayMonitor& replay, bool is_of_replay);
  void add(const SpacingChange& change);

  node::NodeContext& node_;
  const config::Scene& scene_;
  std::vector<State> states_;          // by object
  std::deque<SpacingChange> pending_;  // in the order of their arrival; the newest kMaxPending
  bool was_replaying_ = false;
  // Present if an object has a spacing.
  std::optional<bus::Reader<bus::topics::SpacingRequest>> requests_;
  std::optional<bus::Reader<bus::topics::ObjectSpacing>> recorded_;
  std::optional<bus::Writer<bus::topics::ObjectSpacing>> spacings_;
};

}  // namespace fivepipe::sim
