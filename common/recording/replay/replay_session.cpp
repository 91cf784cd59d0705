#include "common/recording/replay/replay_session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "common/base/regex.h"
#include "common/base/timing.h"
#include "common/base/usage_error.h"
#include "common/recording/replay/node_inputs.h"
#include "common/recording/replay/progress.h"
#include "common/recording/replay/recorded_deployment.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Time for discovery to find the other participants of the domain. Processes announce themselves
// once per second. A replay that waits for readers looks for other writers again when it has them.
constexpr auto kDiscoveryTime = 500ms, kDiscoveryTimeOfNoWait = 1500ms;

// Adds the requested nodes to the plan and returns the topics that they read.
std::set<std::string> add_nodes(ReplayPlan& plan, const recording::Recording& recording,
                                const ReplayRequest& request) {
  const RecordedDeployment recorded(recording, request.settings);
  const config::Deployment& deployment = recorded.deployment();
  plan.shape_cameras = shape_cameras(deployment.rig).size();
  std::set<std::string> topics;
  for (const std::string& name : request.nodes) {
    const config::Node* node = config::find_node(deployment, name);
    if (!node) {
      std::vector<std::string> known;
      for (const config::Node& other : deployment.nodes) known.push_back(other.name);
      throw base::UsageError(
          fmt::format("the recording's deployment has no node '{}'; its nodes are: {}", name,
                      fmt::join(known, ", ")));
    }
    plan.nodes.push_back({name, config::program_of(*node), inputs_of(deployment, *node),
                          hull_view_names(deployment, *node)});
    topics.insert(plan.nodes.back().inputs.begin(), plan.nodes.back().inputs.end());
  }
  return topics;
}

// Returns the reader that is still missing when the time is up; empty if there is none.
std::string wait_for_readers(bus::Bus& bus, const Replayer& replayer, double wait_s,
                             const std::function<bool()>& interrupted) {
  const auto started = Clock::now();
  std::string missing = replayer.missing_reader(), logged;
  while (!missing.empty() && !interrupted() && base::seconds_since(started) < wait_s) {
    if (missing != logged && Clock::now() - started > 1s)
      spdlog::info("waiting for readers: {}", logged = missing);
    bus.wait(20ms);
    missing = replayer.missing_reader();
  }
  return missing;
}

}  // namespace

ReplayPlan plan_for(const recording::Recording& recording, const ReplayRequest& request) {
  ReplayPlan plan;
  std::set<std::string> inputs;
  if (!request.nodes.empty()) inputs = add_nodes(plan, recording, request);
  const base::Regex wanted(request.topics);
  for (const recording::RecordedChannel& channel : recording.channels())
    // A replay announces its own session. A recorded announcement would end that session.
    if (!channel.topic.starts_with(bus::topics::ReplaySession::name) &&
        wanted.found_in(channel.topic) && (request.nodes.empty() || inputs.contains(channel.topic)))
      plan.channels.insert(channel.id);
  set_range(plan, recording, request.start_s, request.end_s);
  plan.rate = request.rate;
  plan.lossless = request.lossless;
  plan.frames_in_flight = request.frames_in_flight;
  plan.order = SendOrder::pipelined;
  return plan;
}

// Returns the deployment of nodes that would refuse the replay; empty: there is none.
std::string other_deployment(bus::Bus& bus, const ReplayRequest& request) {
  const base::Regex wanted(request.topics);
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    if (!endpoint.own && !endpoint.writes && !endpoint.deployment.empty() &&
        endpoint.deployment != request.deployment && wanted.found_in(endpoint.topic))
      return endpoint.deployment;
  return "";
}

// Returns why the replay must not send, or an empty text.
std::string conflict_of(bus::Bus& bus, const Replayer& replayer, const ReplayRequest& request) {
  if (const std::string other = other_deployment(bus, request); !other.empty())
    return fmt::format(
        "the nodes in domain {0} belong to deployment '{1}' and accept only messages of it; this "
        "replay is of {2}. Add --deployment and the file of '{1}', or choose another --domain",
        request.domain, other,
        request.deployment.empty() ? "no deployment" : "deployment '" + request.deployment + "'");
  const auto conflicts = replayer.conflicts();
  if (conflicts.empty() || request.ignore_conflicts) return {};
  return fmt::format(
      "domain {} has other writers of the same topics:\n  {}\nNodes would mix their messages with "
      "the replay. Choose another --domain, or use --force",
      request.domain, fmt::join(conflicts, "\n  "));
}

ReplayResult replay(const recording::Recording& recording, const ReplayRequest& request,
                    const ReplayCallbacks& callbacks) {
  using End = ReplayResult::End;
  const ReplayPlan plan = plan_for(recording, request);
  const std::string file = recording.file().string();
  if (plan.channels.empty())
    return {End::refused, "nothing to replay: no topic of " + file +
                              " matches; `fivepipe info` lists its topics"};
  bus::Bus bus({request.domain, request.network, "replay", request.deployment, request.lossless});
  const auto discovery_time = (request.wait_s ? kDiscoveryTime : kDiscoveryTimeOfNoWait) +
                              bus::authentication_time(request.network);
  for (const auto until = Clock::now() + discovery_time; Clock::now() < until;) bus.wait(20ms);
  Replayer replayer(bus, recording, plan);
  if (const std::string conflict = conflict_of(bus, replayer, request); !conflict.empty())
    return {End::refused, conflict};
  if (request.wait_s) {
    if (const std::string missing =
            wait_for_readers(bus, replayer, *request.wait_s, callbacks.interrupted);
        !missing.empty()) {
      const std::string why = bus.why_not_admitted();
      return {callbacks.interrupted() ? End::stopped : End::no_reader,
              fmt::format("no reader: {} (domain {}); {}", missing, request.domain,
                          why.empty() ? "wait longer with --wait S, or use --no-wait" : why)};
    }
    if (const std::string conflict = conflict_of(bus, replayer, request); !conflict.empty())
      return {End::refused, conflict};
  }

  const auto started = Clock::now();
  auto next_progress = started + kProgressPeriod;
  auto newest = ReplayControl::resume;
  const auto control = [&] {
    if (callbacks.interrupted()) return ReplayControl::stop;
    if (Clock::now() >= next_progress) {
      next_progress += kProgressPeriod;
      spdlog::info("{:.0f} s: {} frames sent{}", base::seconds_since(started),
                   replayer.counts().frames, newest == ReplayControl::pause ? ", paused" : "");
    }
    return newest = callbacks.control();
  };
  bool complete = true;
  do {
    replayer.run(control);
    callbacks.on_round(replayer.counts());
    complete &= replayer.counts().complete();
  } while (request.loop && (complete || !request.lossless) && control() != ReplayControl::stop);
  if (callbacks.interrupted()) return {End::stopped, ""};
  return {complete || !request.lossless ? End::complete : End::incomplete, ""};
}

}  // namespace fivepipe::replay
