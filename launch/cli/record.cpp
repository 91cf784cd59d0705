#include <iostream>

#include "common/pipeline/node/deployment_network.h"
#include "common/recording/replay/recorder.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/inspect/record_report.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::launch {
namespace {

const std::map<std::string, mcap::Compression> kCompressions = {{"none", mcap::Compression::none},
                                                                {"lz4", mcap::Compression::lz4},
                                                                {"zstd", mcap::Compression::zstd}};

struct RecordOptions {
  std::filesystem::path file, deployment;
  std::vector<std::string> settings;
  std::string topics = ".*", compression = "lz4", name = replay::kRecorderName;
  bool without_colour = false, force = false, without_sync = false, domain_given = false;
  double duration_s = 0;
  NetworkOptions network;
};

int run_record(const RecordOptions& options) {
  replay::RecordRequest request{
      .file = options.file,
      .topics = replay::topics_to_record(options.topics, !options.without_colour),
      .writer = {.compression = kCompressions.at(options.compression),
                 .sync = !options.without_sync},
      .settings = settings_from(options.settings),
      .domain = options.network.domain,
      .network = options.network.profile,
      .name = options.name,
      .duration_s = options.duration_s};
  std::optional<config::Deployment> deployment;
  if (!options.deployment.empty()) {
    deployment = config::load_deployment(deployment_file(options.deployment), request.settings);
    request.deployment = &*deployment;
    if (!options.domain_given) request.domain = deployment->domain;
    request.network = node::network_of(*deployment, {security::Role::recorder, request.domain,
                                                     options.network.host, options.network.local});
  }
  std::string refusal = options.force ? "" : replay::refusal_to_overwrite(options.file);
  if (request.topics.empty())
    refusal = "no topic matches '" + options.topics + "'; `fivepipe ls` lists the topics";
  if (!refusal.empty()) {
    std::cerr << refusal << '\n';
    return 2;
  }
  catch_signals();
  if (options.file.has_parent_path())
    std::filesystem::create_directories(options.file.parent_path());
  const replay::RecordResult result = replay::record(request, signals_received);
  std::cout << summary_text(request, result) << std::flush;
  std::cerr << problems_text(request, result);
  return result.complete() ? 0 : 1;
}

}  // namespace

void add_record(CLI::App& app, Command& command) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* record = app.add_subcommand(
      "record", "Record the messages on the bus to an MCAP file, for --duration or until Ctrl-C");
  record->footer(
      "Examples:\n"
      "  fivepipe record -o session.mcap --deployment launch/deployments/demo.yaml\n"
      "  fivepipe record -o shapes.mcap --no-colour --duration 60 --compression zstd\n"
      "  fivepipe record -o maps.mcap --topics 'ObjectPixelMap|HeadPose|Info'\n"
      "  fivepipe record -o all.mcap --topics '.*|ReplaySession'    ReplaySession is recorded only "
      "if named\n"
      "  fivepipe up launch/deployments/demo.yaml --record session.mcap    run and record\n\n"
      "Exit codes: 0 everything that nodes sent is in the file, 1 messages are missing (listed by "
      "topic) or none arrived, 2 usage or configuration error, no topic matches, or the file "
      "exists.");
  record->add_option("-o,--output", options->file, "file to write (MCAP)")->required();
  record->add_flag("--force", options->force, "overwrite an existing file");
  record->add_option("--deployment", options->deployment,
                     "deployment file; the recording contains it and all files that it names, so "
                     "it can be replayed and measured on any machine");
  add_set_option(record, options->settings);
  add_topics_option(record, options->topics);
  record->add_flag("--no-colour", options->without_colour,
                   "record no images of people: neither camera colours nor coloured hull tiles");
  record->add_option("--compression", options->compression, "lz4, zstd (smaller, slower) or none")
      ->check(CLI::IsMember(kCompressions))
      ->capture_default_str();
  record->add_flag("--no-sync", options->without_sync,
                   "do not force data to the disk every 0.5 s; a power cut then loses what the "
                   "kernel has not written yet, about 30 s");
  record->add_option("--duration", options->duration_s, "seconds to record; default: until Ctrl-C")
      ->check(CLI::PositiveNumber);
  record->add_option("--name", options->name, "name of the recorder on the bus")
      ->capture_default_str();
  add_network_options(record, options->network);
  add_host_options(record, options->network);
  record->get_option("--domain")
      ->description("DDS domain (default: that of --deployment, otherwise 0)")
      ->default_str("");
  record->callback([record, options, &command] {
    options->domain_given = record->count("--domain") > 0;
    command = [options] { return run_record(*options); };
  });
}

}  // namespace fivepipe::launch
