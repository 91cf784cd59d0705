#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <regex>

#include "common/base/realtime.h"
#include "common/base/version.h"
#include "common/pipeline/node/status.h"
#include "common/recording/replay/recorder.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kProgressPeriod = 5s;
// After the last message: what was sent before may still be on its way.
constexpr auto kDrainTime = 200ms;

struct RecordOptions {
  std::filesystem::path file, deployment;
  std::vector<std::string> settings;
  std::string topics = ".*", compression = "lz4", name = replay::kRecorderName;
  bool without_colour = false, force = false, without_sync = false;
  double duration_s = 0;
  NetworkOptions network;
  bool domain_given = false;
};

const std::map<std::string, mcap::Compression> kCompressions = {{"none", mcap::Compression::none},
                                                                {"lz4", mcap::Compression::lz4},
                                                                {"zstd", mcap::Compression::zstd}};

// Topics that carry pictures: hull tiles are coloured.
bool has_pictures(const bus::topics::Topic& topic) {
  return std::string(topic.name) == bus::topics::ObjectColour::name ||
         std::string(topic.name) == bus::topics::HullTile::name;
}

std::vector<bus::topics::Topic> wanted_topics(const RecordOptions& options) {
  const std::regex wanted(options.topics);
  std::vector<bus::topics::Topic> chosen;
  for (const bus::topics::Topic& topic : bus::topics::all()) {
    if (std::string(topic.name) == bus::topics::ReplaySession::name)
      continue;  // of whoever replays, not of what is replayed
    if (std::regex_search(topic.name, wanted) && !(options.without_colour && has_pictures(topic)))
      chosen.push_back(topic);
  }
  return chosen;
}

struct Sum {
  std::uint64_t received = 0, written = 0, lost = 0, missing = 0;
};
Sum sum_of(const std::map<std::string, recording::TopicCounts>& counts) {
  Sum sum;
  for (const auto& [topic, count] : counts) {
    sum.received += count.received;
    sum.written += count.written;
    sum.lost += count.lost;
    sum.missing += count.missing;
  }
  return sum;
}

void publish_counts(node::NodeStatusReporter& status,
                    const std::map<std::string, recording::TopicCounts>& counts) {
  for (const auto& [topic, count] : counts)
    status.recorded(topic, {count.received, count.written, count.lost});
}

void print_table(const std::map<std::string, recording::TopicCounts>& counts) {
  std::printf("%-36s %10s %10s %8s %10s\n", "topic", "received", "written", "lost", "MB");
  for (const auto& [topic, count] : counts)
    std::printf("%-36s %10llu %10llu %8llu %10.1f\n", topic.c_str(),
                static_cast<unsigned long long>(count.received),
                static_cast<unsigned long long>(count.written),
                static_cast<unsigned long long>(count.lost), 1e-6 * double(count.bytes));
  std::fflush(stdout);
}

// Into the file, and to whoever watches.
void note_sent(recording::RecordingWriter& recording, const replay::Recorder& recorder) {
  for (const replay::SentByNode& by : recorder.compared()) {
    recording.add_sent(by.topic, by.sent, by.missing());
    if (by.missing() > 0)
      std::cerr << by.node << " sent " << by.sent << " of " << by.topic << ", " << by.received
                << " came\n";
  }
  std::string unknown;
  for (const std::string& node : recorder.unverified_nodes())
    unknown += (unknown.empty() ? "" : ", ") + (node.empty() ? "somebody without a name" : node);
  if (!unknown.empty())
    std::cerr << "not known whether all came of what these sent, which did not tell, or not "
                 "lately, how much that was: "
              << unknown << '\n';
}

int conclude(const RecordOptions& options, const recording::RecordingWriter& recording,
             double elapsed_s) {
  const auto counts = recording.counts();
  print_table(counts);
  const Sum sum = sum_of(counts);
  std::printf("%s: %llu messages, %.1f MB, %.1f s\n", options.file.c_str(),
              static_cast<unsigned long long>(sum.written),
              1e-6 * double(recording.bytes_written()), elapsed_s);
  std::fflush(stdout);
  if (sum.lost > 0)
    std::cerr << sum.lost << " messages were lost: " << recording.loss_reason() << '\n';
  if (const std::string why = recording.failure(); !why.empty()) {
    if (sum.lost == 0) std::cerr << why << '\n';
    std::cerr << "The file holds everything up to there; `fivepipe info --recover "
              << options.file.string() << "` mends its index.\n";
    return 1;
  }
  if (sum.received == 0)
    std::cerr << "nothing was received; `fivepipe ls --domain " << options.network.domain
              << "` shows who writes there\n";
  return sum.lost == 0 && sum.missing == 0 && sum.received > 0 ? 0 : 1;
}

int run_record(RecordOptions options) {
  std::optional<config::Deployment> deployment;
  const auto settings = settings_from(options.settings);
  if (!options.deployment.empty()) {
    deployment = config::load_deployment(options.deployment, settings);
    if (!options.domain_given) options.network.domain = deployment->domain;
    options.network.profile = deployment->network_profile;
  }
  const std::vector<bus::topics::Topic> topics = wanted_topics(options);
  if (topics.empty()) {
    std::cerr << "no topic's name matches '" << options.topics << "'; `fivepipe ls` shows them\n";
    return 2;
  }
  if (const std::string why = replay::refusal_to_overwrite(options.file);
      !options.force && !why.empty()) {
    std::cerr << why << '\n';
    return 2;
  }
  catch_signals();
  if (options.file.has_parent_path())
    std::filesystem::create_directories(options.file.parent_path());
  recording::RecordingWriter recording(
      options.file, std::string("fivepipe ") + base::version(),
      {.compression = kCompressions.at(options.compression), .sync = !options.without_sync});
  replay::write_header(recording, deployment ? &*deployment : nullptr, settings,
                       options.network.domain);
  bus::Bus bus({options.network.domain, options.network.profile, options.name});
  for (const std::string& warning : bus.warnings()) spdlog::warn("{}", warning);
  replay::Recorder recorder(bus, recording, topics);
  node::NodeStatusReporter status(bus, options.name);
  spdlog::info("recording {} topics of domain {} into {}; Ctrl-C ends it", topics.size(),
               options.network.domain, options.file.string());

  const auto started = Clock::now();
  auto next_progress = started + kProgressPeriod;
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(Clock::now() - started).count();
  };
  std::optional<Clock::time_point> ends;
  while (!ends || Clock::now() < *ends) {
    bus.wait(50ms);
    recorder.take();
    const bool over = signals_received() > 0 ||
                      (options.duration_s > 0 && elapsed_s() >= options.duration_s) ||
                      !recording.failure().empty();
    if (over && !ends) {
      ends = Clock::now() + kDrainTime;
      if (const std::string why = recording.failure(); !why.empty())
        spdlog::error("the recording ends: {}", why);
    }
    if (Clock::now() < next_progress) continue;
    next_progress += kProgressPeriod;
    const auto counts = recording.counts();
    publish_counts(status, counts);
    const Sum sum = sum_of(counts);
    spdlog::info("{:.0f} s: {} messages, {:.1f} MB written, {} lost", elapsed_s(), sum.received,
                 1e-6 * double(recording.bytes_written()), sum.lost);
  }
  note_sent(recording, recorder);
  // A second signal, or one while nothing but the disk is waited for.
  recording.finish([before = signals_received()] { return signals_received() > before; });
  publish_counts(status, recording.counts());
  return conclude(options, recording, elapsed_s());
}

}  // namespace

void add_record(CLI::App& app, Command& command) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* record = app.add_subcommand(
      "record", "Record what is on the bus into an MCAP file until --duration is over or Ctrl-C");
  record->footer(
      "Examples:\n"
      "  fivepipe record -o session.mcap --deployment launch/deployments/demo.yaml\n"
      "  fivepipe record -o shapes.mcap --no-colour --duration 60 --compression zstd\n"
      "  fivepipe record -o maps.mcap --topics 'ObjectPixelMap|HeadPose|Info'\n"
      "  fivepipe up launch/deployments/demo.yaml --record session.mcap    both at once\n\n"
      "Exit codes: 0 everything that was sent is in the file, 1 something is missing (said by "
      "topic), 2 usage or configuration.");
  record->add_option("-o,--output", options->file, "file to write (MCAP)")->required();
  record->add_flag("--force", options->force, "overwrite a file that is there");
  record->add_option("--deployment", options->deployment,
                     "deployment file: attached with all that it names, so that the recording can "
                     "be replayed and measured anywhere");
  add_set_option(record, options->settings);
  add_topics_option(record, options->topics);
  record->add_flag("--no-colour", options->without_colour,
                   "no pictures of people: neither camera colours nor the coloured hull tiles");
  record->add_option("--compression", options->compression, "lz4, zstd (smaller, slower) or none")
      ->check(CLI::IsMember(kCompressions))
      ->capture_default_str();
  record->add_flag("--no-sync", options->without_sync,
                   "don't force the disk twice a second: a power cut then costs what the kernel "
                   "had not written yet");
  record->add_option("--duration", options->duration_s, "seconds; without it: until Ctrl-C")
      ->check(CLI::PositiveNumber);
  record->add_option("--name", options->name, "what it calls itself on the bus")
      ->capture_default_str();
  add_network_options(record, options->network);
  record->callback([record, options, &command] {
    options->domain_given = record->count("--domain") > 0;
    command = [options] { return run_record(*options); };
  });
}

}  // namespace fivepipe::launch
