#include "benchmarks/nodes/node_run.h"

#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <set>

#include "common/recording/replay/node_inputs.h"
#include "launch/supervise/hosts/free_domain.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The time that a node may need to load shaders and meshes before it reads and writes.
constexpr auto kStartTimeout = 30s;

// Such messages differ from run to run.
bool has_timestamps(const std::string& topic) {
  static const std::set<std::string> timed = {
      bus::topics::TileCosts::name, bus::topics::FrameComposited::name,
      bus::topics::FrameTrace::name, bus::topics::NodeStatus::name,
      bus::topics::ReplaySession::name};
  return timed.contains(topic);
}

// Reads the nodes' output and computes its checksums.
class Outputs {
 public:
  Outputs(bus::Bus& bus, const std::set<std::string>& replayed) {
    for (const bus::topics::Topic& topic : bus::topics::all())
      if (!has_timestamps(topic.name) && !replayed.contains(topic.name))
        readers_.push_back({topic, bus::SerializedReader(bus, topic)});
  }
  void take() {
    for (auto& [topic, reader] : readers_)
      reader.take([&, name = topic.name](const bus::SerializedSample& sample) {
        if (sample.kind != bus::SampleKind::data) return;
        OutputDigest& digest = digests_[name];
        ++digest.messages;
        digest.bytes += sample.cdr.size();
        digest.checksum += XXH3_64bits(sample.cdr.data(), sample.cdr.size());
      });
  }
  const std::map<std::string, OutputDigest>& digests() const { return digests_; }

 private:
  std::vector<std::pair<bus::topics::Topic, bus::SerializedReader>> readers_;
  std::map<std::string, OutputDigest> digests_;
};

replay::ReplayPlan plan_of(const recording::Recording& recording, const NodeRunOptions& options) {
  replay::ReplayPlan plan;
  std::set<std::string> read, written;
  for (const std::string& name : options.nodes) {
    const config::Node& node = *config::find_node(*options.deployment, name);
    plan.nodes.push_back({name, config::program_of(node),
                          replay::inputs_of(*options.deployment, node),
                          replay::hull_view_names(*options.deployment, node)});
    read.insert(plan.nodes.back().inputs.begin(), plan.nodes.back().inputs.end());
    written.merge(replay::outputs_of(*options.deployment, node));
  }
  for (const recording::RecordedChannel& channel : recording.channels())
    if (read.contains(channel.topic) &&
        !written.contains(channel.topic))  // the output of started nodes is not replayed
      plan.channels.insert(channel.id);
  replay::set_range(plan, recording, options.start_s, options.end_s);
  plan.rate = options.rate;
  plan.lossless = true;
  plan.frames_in_flight = options.frames_in_flight;
  plan.order = options.order;
  plan.shape_cameras = config::shape_cameras(options.deployment->rig).size();
  return plan;
}

// Waits until the replay's writers match the nodes' readers and discovery has found the nodes'
// writers: RunObserver::trace_bus() follows only writers that are known when it is called.
void wait_until_connected(bus::Bus& bus, const replay::Replayer& replayer,
                          const NodeRunOptions& options, NodeProcesses& nodes) {
  for (const auto until = Clock::now() + kStartTimeout;; bus.wait(20ms)) {
    nodes.check();
    std::string missing = replayer.missing_reader();
    if (missing.empty()) missing = missing_endpoint(bus, options);
    if (missing.empty()) return;
    if (launch::signals_received() > 0) throw std::runtime_error("interrupted");
    if (Clock::now() > until) throw std::runtime_error(missing);
  }
}

}  // namespace

std::uint64_t dropped_by(const NodeRun& run, const std::string& node) {
  std::uint64_t dropped = 0;
  if (const auto drops = run.drops.find(node); drops != run.drops.end())
    for (const auto& [reason, count] : drops->second)
      dropped += reason == "video_frame" ? 0 : count;
  return dropped;
}

bool is_valid_run(const NodeRun& run) {
  bool valid = run.counts.complete();
  for (const auto& [node, expected] : run.counts.expected) {
    if (expected == 0)
      std::cerr << "the recording has no complete frame for node '" << node
                << "' in this range: its inputs were not recorded\n";
    if (const std::uint64_t dropped = dropped_by(run, node))
      std::cerr << "node '" << node << "' dropped " << dropped << " of its inputs\n";
    valid &= expected > 0 && dropped_by(run, node) == 0;
  }
  if (run.counts.late)
    std::cerr
        << run.counts.late
        << " messages are too far from their frame in the file, because the recorder lagged\n";
  if (run.counts.damaged)
    std::cerr << run.counts.damaged << " chunks of the recording are damaged\n";
  return valid;
}

NodeRun run_nodes(const recording::Recording& recording, const NodeRunOptions& options) {
  const std::uint32_t domain = launch::free_domain();
  const replay::ReplayPlan plan = plan_of(recording, options);
  NodeProcesses nodes(options, domain);
  bus::Bus bus({.domain = domain,
                .participant = "replay",
                .deployment = options.deployment->name,
                .frequent_heartbeats = true});
  RunObserver observer(bus, domain, {options.nodes.begin(), options.nodes.end()});
  if (std::any_of(plan.nodes.begin(), plan.nodes.end(), [&](const replay::ReplayedNode& node) {
        return replay::outputs_of(node.program, options.deployment->scene)
            .contains(bus::topics::FrameComposited::name);
      }))
    observer.listen_to_composites();
  replay::Replayer replayer(bus, recording, plan);
  std::set<std::string> replayed;
  for (const mcap::Id id : plan.channels) replayed.insert(recording.channel(id)->topic);
  std::optional<Outputs> outputs;
  if (options.checksums) outputs.emplace(bus, replayed);
  wait_until_connected(bus, replayer, options, nodes);
  if (options.trace_bus) observer.trace_bus();
  replayer.on_frame_sent = [&](std::uint64_t frame, const replay::SendTimes& sent) {
    observer.sent(frame, sent);
  };
  replayer.set_trace_listener(
      [&](const fivepipe_v1_FrameTrace& trace) { observer.handled(trace); });
  const auto before = nodes.use();
  const double own_before_s = cpu_s_of(getpid());
  // Reads everything: a reader with unread samples would end each wait at once.
  const auto take_outputs = [&] {
    observer.take_statuses();
    if (outputs) outputs->take();
  };
  replayer.run([&] {
    take_outputs();
    nodes.check();
    return launch::signals_received() > 0 ? replay::ReplayControl::stop
                                          : replay::ReplayControl::resume;
  });
  NodeRun run;
  run.use = nodes.use_since(before);
  run.replay_cpu_s = cpu_s_of(getpid()) - own_before_s;
  nodes.check();
  nodes.stop();
  take_outputs();
  static_cast<RunObservations&>(run) = observer.end(true);
  run.counts = replayer.counts();
  if (outputs) run.outputs = outputs->digests();
  return run;
}

}  // namespace fivepipe::node_bench
