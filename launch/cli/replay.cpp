#include <spdlog/spdlog.h>

#include <iostream>
#include <optional>

#include "common/recording/replay/recorded_deployment.h"
#include "common/recording/replay/replay_session.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/cli/replay_keys.h"
#include "launch/inspect/replay_report.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

struct ReplayOptions {
  std::filesystem::path file;
  std::string rate = "1";
  std::vector<std::string> settings;
  double wait_s = 20;
  bool paused = false, no_wait = false;
  NetworkOptions network;
  replay::ReplayRequest request;  // all other options
};

int exit_code(replay::ReplayResult::End end) {
  using End = replay::ReplayResult::End;
  switch (end) {
    case End::complete: return 0;
    case End::incomplete: return 1;
    case End::refused: return 2;
    case End::no_reader: return 3;
    case End::stopped: return 130;
  }
  return 1;
}

// A recording of an earlier version can be replayed although its deployment cannot be loaded.
std::string recorded_name(const recording::Recording& recording,
                          const std::map<std::string, std::string>& settings) {
  try {
    return replay::recorded_deployment_name(recording, settings);
  } catch (const config::ConfigError& error) {
    spdlog::warn(
        "the recorded deployment cannot be loaded; the nodes of a deployment refuse the messages "
        "unless --deployment names theirs: {}",
        error.what());
    return "";
  }
}

int run_replay(const ReplayOptions& options) {
  const recording::Recording recording(options.file);
  if (!recording.mcap().is_finished())
    spdlog::warn("{}; replaying its complete chunks", recording.mcap().damage().summary);
  replay::ReplayRequest request = options.request;
  request.rate = rate_from(options.rate);
  request.settings = settings_from(options.settings);
  NetworkOptions network = options.network;
  network.settings = options.settings;
  const JoinedNetwork joined = network_from(network, security::Role::replay);
  request.domain = joined.domain;
  request.network = joined.network;
  request.deployment =
      joined.deployment.empty() ? recorded_name(recording, request.settings) : joined.deployment;
  request.wait_s = options.no_wait ? std::nullopt : std::optional(options.wait_s);
  catch_signals();
  std::optional<ReplayKeys> keys;  // created when sending starts, because it changes the terminal
  const replay::ReplayResult result = replay::replay(
      recording, request,
      {.control =
           [&] {
             if (!keys) keys.emplace(options.paused);
             return keys->control();
           },
       .interrupted = [] { return signals_received() > 0; },
       .on_round = [](const auto& counts) { std::cout << text_of(counts) << std::flush; }});
  if (!result.message.empty()) std::cerr << result.message << '\n';
  if (result.end == replay::ReplayResult::End::incomplete)
    std::cerr << "not lossless: the counts above differ, or no frame was complete for the nodes\n";
  return exit_code(result.end);
}

}  // namespace

void add_replay(CLI::App& app, Command& command) {
  auto options = std::make_shared<ReplayOptions>();
  replay::ReplayRequest& request = options->request;
  CLI::App* replay = app.add_subcommand("replay", "Send the messages of a recording to a domain");
  replay->footer(
      "Examples:\n"
      "  fivepipe replay session.mcap --domain 7           all topics, at the recorded rate, to "
      "programs that already run there\n"
      "  fivepipe replay session.mcap --domain 7 --no-wait the same without a program that reads\n"
      "  fivepipe replay session.mcap --inputs-of recon_a --lossless --rate max\n"
      "  fivepipe replay session.mcap --start 10 --end 12 --loop --rate 0.25\n"
      "  fivepipe replay session.mcap --paused             keys: space pauses or continues, s "
      "pauses and sends one frame, q quits\n\n"
      "Exit codes: 0 done, 1 --lossless and a message was not delivered or a frame not handled, 2 "
      "usage error, or nodes of the domain write the same topics, 3 no reader, 130 interrupted.");
  replay->add_option("FILE", options->file, "recording (MCAP)")->required()->check(existing_file());
  add_rate_option(replay, options->rate);
  add_range_options(replay, request.start_s, request.end_s);
  add_topics_option(replay, request.topics);
  replay
      ->add_option("--inputs-of", request.nodes,
                   "send only the inputs of this node, and wait for the node; repeatable")
      ->allow_extra_args(false);
  add_set_option(replay, options->settings);
  replay->add_flag("--lossless", request.lossless,
                   "wait until readers have every message and the nodes of --inputs-of have "
                   "handled every frame");
  replay
      ->add_option("--in-flight", request.frames_in_flight,
                   "with --lossless: maximum number of frames that a node has not handled yet")
      ->check(CLI::Range(1, 6))
      ->capture_default_str();
  replay->add_flag("--loop", request.loop, "start again at the end");
  replay->add_flag("--paused", options->paused, "start paused");
  replay
      ->add_option("--wait", options->wait_s,
                   "maximum wait for readers, in seconds: for the nodes of --inputs-of, otherwise "
                   "for a reader of any topic")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  replay->add_flag("--no-wait", options->no_wait, "do not wait for readers");
  replay->add_flag("--force", request.ignore_conflicts,
                   "replay even if nodes of the domain write the same topics");
  add_network_options(replay, options->network);
  add_deployment_options(replay, options->network);
  replay->get_option("--domain")->description("DDS domain, not that of the recording");
  replay->callback([options, &command] { command = [options] { return run_replay(*options); }; });
}

}  // namespace fivepipe::launch
