#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <optional>
#include <regex>

#include "common/base/usage_error.h"
#include "common/recording/replay/node_inputs.h"
#include "common/recording/replay/recorded_deployment.h"
#include "common/recording/replay/replayer.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/cli/replay_keys.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Whoever is on the network has been heard of by then.
constexpr auto kListeningTime = 500ms;
constexpr auto kProgressPeriod = 5s;

struct ReplayOptions {
  std::filesystem::path file;
  std::string rate = "1", topics = ".*";
  double start_s = 0;
  std::optional<double> end_s;
  std::vector<std::string> nodes, settings;
  bool lossless = false, loop = false, paused = false, force = false, no_wait = false;
  int frames_in_flight = 2;
  double wait_s = 20;
  NetworkOptions network;
};

struct Selection {
  std::vector<replay::ReplayedNode> nodes;
  std::size_t shape_cameras = 0;
  std::set<std::string> topics;  // that they read; all, where no node is named
};

// The nodes that --inputs-of names, as the recording's deployment knows them.
Selection selected(const recording::Recording& recording, const ReplayOptions& options) {
  Selection selection;
  if (options.nodes.empty()) return selection;
  const replay::RecordedDeployment recorded(recording, settings_from(options.settings));
  selection.shape_cameras = shape_cameras(recorded.deployment().rig).size();
  for (const std::string& name : options.nodes) {
    const config::Node* node = config::find_node(recorded.deployment(), name);
    if (!node) {
      std::string known;
      for (const config::Node& other : recorded.deployment().nodes) known += " " + other.name;
      throw base::UsageError("no node '" + name +
                             "' in the recording's deployment; there are:" + known);
    }
    selection.nodes.push_back({name, config::program_of(*node)});
    selection.topics.merge(replay::inputs_of(config::program_of(*node)));
  }
  return selection;
}

replay::ReplayPlan plan_of(const recording::Recording& recording, const ReplayOptions& options) {
  const Selection selection = selected(recording, options);
  const std::regex wanted(options.topics);
  replay::ReplayPlan plan;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (std::regex_search(channel.topic, wanted) &&
        (selection.nodes.empty() || selection.topics.contains(channel.topic)))
      plan.channels.insert(channel.id);
  replay::set_range(plan, recording, options.start_s, options.end_s);
  plan.rate = rate_from(options.rate);
  plan.lossless = options.lossless;
  plan.nodes = selection.nodes;
  plan.shape_cameras = selection.shape_cameras;
  plan.frames_in_flight = options.frames_in_flight;
  plan.order = replay::SendOrder::pipelined;
  return plan;
}

// Empty: all are there, or nobody asked. Otherwise what is still missing when the time is up.
std::string wait_for_readers(bus::Bus& bus, const replay::Replayer& replayer,
                             const ReplayOptions& options) {
  if (options.no_wait) return "";
  const auto started = Clock::now();
  std::string missing = replayer.missing_reader(), told;
  while (!missing.empty() && signals_received() == 0 &&
         std::chrono::duration<double>(Clock::now() - started).count() < options.wait_s) {
    if (missing != told && Clock::now() - started > 1s) spdlog::info("waiting: {}", told = missing);
    bus.wait(20ms);
    missing = replayer.missing_reader();
  }
  return missing;
}

void print_counts(const replay::ReplayCounts& counts) {
  std::printf("%-36s %10s %10s\n", "topic", "in file", "sent");
  for (const auto& [topic, in_file] : counts.in_file)
    std::printf("%-36s %10llu %10llu\n", topic.c_str(), static_cast<unsigned long long>(in_file),
                static_cast<unsigned long long>(counts.sent.at(topic)));
  for (const auto& [node, expected] : counts.expected)
    std::printf("node %-31s %10llu frames, handled %llu\n", node.c_str(),
                static_cast<unsigned long long>(expected),
                static_cast<unsigned long long>(counts.handled.at(node)));
  if (counts.damaged)
    std::printf("%llu chunks of the file are damaged\n",
                static_cast<unsigned long long>(counts.damaged));
  if (counts.late)
    std::printf("%llu messages stand far from their frame in the file\n",
                static_cast<unsigned long long>(counts.late));
  std::printf("%.2f s\n", counts.seconds);
  std::fflush(stdout);
}

int run_replay(const ReplayOptions& options) {
  const recording::Recording recording(options.file);
  if (!recording.mcap().is_finished())
    spdlog::warn("{}: {}; what is whole of it is replayed", options.file.string(),
                 recording.mcap().damage().summary);
  const replay::ReplayPlan plan = plan_of(recording, options);
  if (plan.channels.empty()) {
    std::cerr << "nothing to replay: no topic of " << options.file.string()
              << " matches; `fivepipe info` shows them\n";
    return 2;
  }
  catch_signals();
  bus::Bus bus({options.network.domain, options.network.profile, "replay", options.lossless});
  for (const auto until = Clock::now() + kListeningTime; Clock::now() < until;) bus.wait(20ms);
  replay::Replayer replayer(bus, recording, plan);
  if (const auto conflicts = replayer.conflicts(); !conflicts.empty() && !options.force) {
    std::cerr << "domain " << options.network.domain << " has a deployment running:";
    for (const std::string& conflict : conflicts) std::cerr << "\n  " << conflict;
    std::cerr << "\nA replay beside it would mix the two. Choose another --domain, or --force\n";
    return 2;
  }
  if (const std::string missing = wait_for_readers(bus, replayer, options); !missing.empty()) {
    std::cerr << "no reader: " << missing << " (domain " << options.network.domain
              << "; --wait S waits longer, --no-wait does not)\n";
    return signals_received() > 0 ? 130 : 3;
  }
  ReplayKeys keys(options.paused);
  const auto started = Clock::now();
  auto next_progress = started + kProgressPeriod;
  const auto control = [&] {
    if (signals_received() > 0) return replay::ReplayControl::stop;
    if (Clock::now() >= next_progress) {
      next_progress += kProgressPeriod;
      spdlog::info("{:.0f} s: {} frames sent{}",
                   std::chrono::duration<double>(Clock::now() - started).count(),
                   replayer.counts().frames, keys.paused() ? ", paused" : "");
    }
    return keys.control();
  };
  bool complete = true;
  do {
    replayer.run(control);
    print_counts(replayer.counts());
    complete &= replayer.counts().complete();
  } while (options.loop && (complete || !options.lossless) && signals_received() == 0 &&
           keys.control() != replay::ReplayControl::stop);
  if (signals_received() > 0) return 130;
  if (options.lossless && !complete)
    std::cerr << "not lossless: the counts above differ, or no frame was complete for the nodes\n";
  return options.lossless && !complete ? 1 : 0;
}

}  // namespace

void add_replay(CLI::App& app, Command& command) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* replay = app.add_subcommand(
      "replay", "Send a recording's messages again, as they were, into any domain");
  replay->footer(
      "Examples:\n"
      "  fivepipe replay session.mcap --domain 7                     all topics, as fast as they "
      "were\n"
      "  fivepipe replay session.mcap --inputs-of recon_a --lossless --rate max\n"
      "  fivepipe replay session.mcap --start 10 --end 12 --loop --rate 0.25\n"
      "  fivepipe replay session.mcap --paused                       then keys: space goes on and "
      "pauses, s steps a frame, q ends\n\n"
      "Exit codes: 0 done, 1 --lossless and something did not arrive or was not handled, 2 usage, "
      "or a deployment runs in the domain, 3 nobody reads, 130 interrupted.");
  replay->add_option("FILE", options->file, "recording (MCAP)")
      ->required()
      ->check(CLI::ExistingFile);
  add_rate_option(replay, options->rate);
  add_range_options(replay, options->start_s, options->end_s);
  add_topics_option(replay, options->topics);
  replay
      ->add_option("--inputs-of", options->nodes,
                   "only what this node reads, and wait for this node; may be given several times")
      ->allow_extra_args(false);
  add_set_option(replay, options->settings);
  replay->add_flag("--lossless", options->lossless,
                   "wait until readers have everything, and until the nodes of --inputs-of have "
                   "handled each frame");
  replay
      ->add_option("--in-flight", options->frames_in_flight,
                   "frames that a node has at a time, with --lossless")
      ->check(CLI::Range(1, 6))
      ->capture_default_str();
  replay->add_flag("--loop", options->loop, "start over at the end");
  replay->add_flag("--paused", options->paused, "start paused");
  replay->add_option("--wait", options->wait_s, "seconds to wait for readers")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  replay->add_flag("--no-wait", options->no_wait, "start at once, whoever reads");
  replay->add_flag("--force", options->force, "even into a domain where a deployment runs");
  add_network_options(replay, options->network);
  replay->callback([options, &command] { command = [options] { return run_replay(*options); }; });
}

}  // namespace fivepipe::launch
