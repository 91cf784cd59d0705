#include "benchmarks/nodes/node_run.h"

#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <thread>

#include "benchmarks/nodes/free_domain.h"
#include "common/base/realtime.h"
#include "common/base/usage_error.h"
#include "common/recording/replay/node_inputs.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/process.h"
#include "launch/supervise/program_folder.h"
#include "launch/supervise/status_messages.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The time that a node may need to load shaders and meshes before it reads.
constexpr auto kStartTimeout = 30s;
constexpr auto kStopTimeout = 2s;

// Such messages differ from run to run.
bool has_timestamps(const std::string& topic) {
  static const std::set<std::string> timed = {
      bus::topics::TileCosts::name, bus::topics::FrameComposited::name,
      bus::topics::FrameTrace::name, bus::topics::NodeStatus::name,
      bus::topics::ReplaySession::name};
  return timed.contains(topic);
}

// Returns user and system time in s.
double cpu_s_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string skipped;
  double user = 0, system = 0;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  fields >> user >> system;
  return (user + system) / double(sysconf(_SC_CLK_TCK));
}

double peak_memory_mb_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) * 1024e-6;
  return 0;
}

class Nodes {
 public:
  Nodes(const NodeRunOptions& options, std::uint32_t domain) {
    for (const std::string& name : options.nodes) {
      const config::Node* node = config::find_node(*options.deployment, name);
      std::vector<std::string> words{launch::program_folder() / config::program_of(*node),
                                     "--deployment",
                                     options.file,
                                     "--node",
                                     name,
                                     "--domain",
                                     std::to_string(domain),
                                     "--out",
                                     options.out};
      for (const auto& [key, value] : options.settings)
        words.insert(words.end(), {"--set", key + "=" + value});
      children_.emplace(name, std::make_unique<launch::ChildProcess>(words, node->cores));
    }
  }
  ~Nodes() { stop(); }

  // Throws if a node has ended.
  void check() {
    for (auto& [name, child] : children_) {
      for (std::string& line : child->read_lines()) output_[name] += "\n  " + line;
      if (const auto exit = child->ended())
        throw std::runtime_error("node '" + name + "' ended: " + launch::to_string(*exit) +
                                 output_[name]);
    }
  }
  std::map<std::string, ProcessUse> use() const {
    std::map<std::string, ProcessUse> use;
    for (const auto& [name, child] : children_)
      use[name] = {cpu_s_of(child->pid()), peak_memory_mb_of(child->pid())};
    return use;
  }
  void stop() {
    for (auto& [name, child] : children_) child->signal_group(SIGTERM);
    const auto until = Clock::now() + kStopTimeout;
    const auto runs = [](auto& child) { return !child.second->ended(); };
    while (Clock::now() < until && std::any_of(children_.begin(), children_.end(), runs))
      std::this_thread::sleep_for(10ms);
    children_.clear();  // kills the remaining processes
  }

 private:
  std::map<std::string, std::unique_ptr<launch::ChildProcess>> children_;
  std::map<std::string, std::string> output_;
};

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

// Receives FrameComposited in its own thread, because the replay may be busy sending when one
// arrives.
class CompositeListener {
 public:
  struct ReceivedComposite {
    std::int64_t composited_ns = 0, received_ns = 0;
  };
  CompositeListener(std::uint32_t domain, const std::string& profile)
      : bus_({domain, profile, "replay_composites"}),
        composited_(bus_.reader<bus::topics::FrameComposited>()),
        thread_([this](std::stop_token stop) {
          for (bool last = false; !last; take()) {
            last = stop.stop_requested();
            bus_.wait(last ? 0ms : 20ms);
          }
        }) {}
  // Stops the thread and returns the composites by frame.
  const std::map<std::uint64_t, ReceivedComposite>& end() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    return received_;
  }

 private:
  void take() {
    for (const auto& sample : composited_.take())
      if (sample.valid() && !messages::why_implausible(sample->frame, sample->composited_stamp_ns))
        received_[sample->frame] = {sample->composited_stamp_ns, base::now_realtime_ns()};
  }

  bus::Bus bus_;
  bus::Reader<bus::topics::FrameComposited> composited_;
  std::map<std::uint64_t, ReceivedComposite>
      received_;  // only the thread accesses it until it ends
  std::jthread thread_;
};

replay::ReplayPlan plan_of(const recording::Recording& recording, const NodeRunOptions& options) {
  replay::ReplayPlan plan;
  std::set<std::string> read, written;
  for (const std::string& name : options.nodes) {
    const std::string program = config::program_of(*config::find_node(*options.deployment, name));
    plan.nodes.push_back({name, program});
    read.merge(replay::inputs_of(program));
    written.merge(replay::outputs_of(program));
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

void wait_for_readers(bus::Bus& bus, const replay::Replayer& replayer, Nodes& nodes) {
  for (const auto until = Clock::now() + kStartTimeout;; bus.wait(20ms)) {
    nodes.check();
    const std::string missing = replayer.missing_reader();
    if (missing.empty()) return;
    if (launch::signals_received() > 0) throw std::runtime_error("interrupted");
    if (Clock::now() > until) throw std::runtime_error(missing);
  }
}

replay::FrameAtNode frame_at_node(const fivepipe_v1_FrameTrace& trace) {
  replay::FrameAtNode frame{trace.first_input_ns, trace.last_input_ns, {}};
  for (std::uint32_t i = 0; i < trace.steps._length; ++i) {
    const fivepipe_v1_FrameStep& step = trace.steps._buffer[i];
    frame.steps.push_back({step.step, step.start_ns, step.end_ns});
  }
  return frame;
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
  const std::uint32_t domain = free_domain(options.deployment->network_profile);
  const replay::ReplayPlan plan = plan_of(recording, options);
  // By default, llvmpipe starts a thread per core in every process that draws.
  setenv("LP_NUM_THREADS", "1", 0);
  Nodes nodes(options, domain);
  bus::Bus bus({domain, options.deployment->network_profile, "replay", true});
  auto statuses_in = bus.reader<bus::topics::NodeStatus>();
  launch::StatusRegistry statuses;
  std::optional<CompositeListener> composites;
  if (std::any_of(plan.nodes.begin(), plan.nodes.end(), [](const replay::ReplayedNode& node) {
        return replay::outputs_of(node.program).contains(bus::topics::FrameComposited::name);
      }))
    composites.emplace(domain, options.deployment->network_profile);
  replay::Replayer replayer(bus, recording, plan);
  std::set<std::string> replayed;
  for (const mcap::Id id : plan.channels) replayed.insert(recording.channel(id)->topic);
  std::optional<Outputs> outputs;
  if (options.checksums) outputs.emplace(bus, replayed);
  wait_for_readers(bus, replayer, nodes);

  std::map<std::uint64_t, replay::FrameTimes> frames;
  replayer.on_frame_sent = [&](std::uint64_t frame, const replay::SendTimes& sent) {
    frames[frame].frame = frame;
    frames[frame].sent = sent;
  };
  replayer.set_trace_listener([&](const fivepipe_v1_FrameTrace& trace) {
    frames[trace.frame].nodes[trace.node] = frame_at_node(trace);
  });
  const auto before = nodes.use();
  const double own_before_s = cpu_s_of(getpid());
  // Reads everything: a reader with unread samples would end each wait at once.
  const auto take_outputs = [&] {
    launch::take_statuses(statuses_in, statuses, {options.nodes.begin(), options.nodes.end()});
    if (outputs) outputs->take();
  };
  replayer.run([&] {
    take_outputs();
    nodes.check();
    return launch::signals_received() > 0 ? replay::ReplayControl::stop
                                          : replay::ReplayControl::resume;
  });
  NodeRun run;
  run.use = nodes.use();
  for (auto& [name, use] : run.use) use.cpu_s -= before.at(name).cpu_s;
  run.replay_cpu_s = cpu_s_of(getpid()) - own_before_s;
  nodes.check();
  nodes.stop();
  take_outputs();
  if (composites)
    for (const auto& [frame, received] : composites->end()) {
      frames[frame].composited_ns = received.composited_ns;
      frames[frame].composite_received_ns = received.received_ns;
    }
  for (const auto& [name, processes] : statuses.processes()) {
    run.drops[name] = processes.back().drops;
    if (!processes.back().gl_renderer.empty()) run.gl_renderer = processes.back().gl_renderer;
  }
  run.counts = replayer.counts();
  if (outputs) run.outputs = outputs->digests();
  for (auto& [frame, times] : frames)
    if (times.sent.start_ns > 0 && times.nodes.size() == options.nodes.size())
      run.frames.push_back(std::move(times));
  return run;
}

}  // namespace fivepipe::node_bench
