#include "benchmarks/nodes/pipeline/live_run.h"

#include <chrono>
#include <functional>
#include <set>
#include <stdexcept>

#include "common/recording/replay/node_inputs.h"
#include "launch/supervise/hosts/free_domain.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The time that nodes may need to load shaders and meshes, and capture_node for its cameras.
constexpr auto kStartTimeout = 120s;

// Returns the first endpoint of a node that discovery has not found; empty if it found all.
std::string missing_endpoint(bus::Bus& bus, const NodesToStart& options) {
  std::map<std::string, std::set<std::string>> reads, writes;  // by node
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    (endpoint.writes ? writes : reads)[endpoint.participant].insert(endpoint.topic);
  for (const std::string& name : options.nodes) {
    const config::Node& node = *config::find_node(*options.deployment, name);
    for (const std::string& topic : replay::inputs_of(*options.deployment, node))
      if (!reads[name].contains(topic)) return "node '" + name + "' does not read " + topic;
    for (const std::string& topic : replay::outputs_of(*options.deployment, node))
      if (!writes[name].contains(topic)) return "node '" + name + "' does not write " + topic;
  }
  return "";
}

}  // namespace

LiveRun run_live(const NodesToStart& options, double duration_s) {
  const std::uint32_t domain = launch::free_domain();
  bus::Bus bus({.domain = domain, .participant = "bench"});
  RunObserver observer(bus, domain, {options.nodes.begin(), options.nodes.end()});
  observer.listen_to_composites();
  auto traces = bus.reader<bus::topics::FrameTrace>();
  auto composited = bus.reader<bus::topics::FrameComposited>();
  NodeProcesses nodes(options, domain);
  // Waits until `done` or until the timeout, and takes the traces meanwhile.
  const auto wait = [&](Clock::duration timeout, bool keep, const std::function<bool()>& done) {
    for (const auto until = Clock::now() + timeout; !done();) {
      if (launch::signals_received() > 0) throw std::runtime_error("interrupted");
      if (Clock::now() >= until) return false;
      nodes.check();
      bus.wait(20ms);
      observer.take_statuses();
      for (const auto& trace : traces.take())
        if (keep && trace.valid()) observer.handled(*trace);
    }
    return true;
  };
  if (!wait(kStartTimeout, false, [&] { return missing_endpoint(bus, options).empty(); }))
    throw std::runtime_error(missing_endpoint(bus, options));
  observer.trace_bus();
  if (!wait(kStartTimeout, false, [&] { return !composited.take().empty(); }))
    throw std::runtime_error("no frame was composited");
  const auto seconds = [](double s) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };
  const auto never = [&] { return composited.take(), false; };
  wait(seconds(kWarmUp_s), false, never);
  const auto before = nodes.use();
  const auto start = Clock::now();
  wait(seconds(duration_s), true, never);
  LiveRun run;
  run.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  run.use = nodes.use_since(before);
  nodes.stop();
  static_cast<RunObservations&>(run) = observer.end(false);
  return run;
}

}  // namespace fivepipe::node_bench
