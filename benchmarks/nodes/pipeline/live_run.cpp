#include "benchmarks/nodes/pipeline/live_run.h"

#include <chrono>
#include <functional>
#include <stdexcept>

#include "launch/supervise/hosts/free_domain.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The time that nodes may need to load shaders and meshes, and capture_node for its cameras.
constexpr auto kStartTimeout = 120s;

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
  std::string missing;
  if (!wait(kStartTimeout, false,
            [&] { return (missing = missing_endpoint(bus, options)).empty(); }))
    throw std::runtime_error(missing);
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
