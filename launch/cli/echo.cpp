#include <unistd.h>

#include <chrono>
#include <iostream>
#include <system_error>

#include "common/base/output_queue.h"
#include "common/base/realtime.h"
#include "common/base/text_table.h"
#include "common/recording/schema/wire_types.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/inspect/message_formatter.h"
#include "launch/inspect/topic_source.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// After so long without a writer it is said that one is waited for.
constexpr auto kWriterTimeout = 2s;

struct EchoOptions {
  std::string topic, field;
  std::filesystem::path file;
  std::uint64_t count = 0;  // 0: all
  double start_s = 0;
  std::optional<double> end_s;
  bool json = false, full = false;
  NetworkOptions network;
  TextOptions text() const {
    return {json, full, field.empty() ? std::nullopt : std::optional(FieldPath(field))};
  }
};

// Ends the output; throws where it could not be written.
void finish(base::OutputQueue& output) {
  if (const int error = output.finish())
    throw std::system_error(error, std::generic_category(), "standard output");
}

int echo_from_file(const EchoOptions& options) {
  const recording::Recording recording = opened(options.file);
  const std::string topic = resolve_topic(options.topic, topics_in(recording));
  const TextOptions text_options = options.text();
  std::map<mcap::Id, MessageFormatter> text_of;
  base::OutputQueue output(STDOUT_FILENO);
  std::uint64_t shown = 0;
  const int result = each_message(
      recording, topic, options.start_s, options.end_s,
      [&](const recording::RecordedMessage& message) {
        auto text = text_of.find(message.channel->id);
        if (text == text_of.end()) {
          const recording::RecordedChannel& of_data = data_channel(recording, *message.channel);
          text = text_of
                     .emplace(message.channel->id,
                              MessageFormatter(recording.idl(of_data), of_data.type, text_options))
                     .first;
        }
        output.put(text->second({topic, message.channel->node, message.source_stamp_ns,
                                 message.log_stamp_ns, message.key_change, message.cdr}));
        return ++shown != options.count && signals_received() == 0 && !output.closed();
      });
  finish(output);
  if (shown == 0)
    std::cerr << topic << ": no message"
              << (options.start_s > 0 || options.end_s ? " in this time" : "") << "\n";
  return signals_received() > 0 ? 130 : result;
}

int echo_live(const EchoOptions& options) {
  const bus::topics::Topic topic = live_topic(options.topic);
  const MessageFormatter text_of(schema::fivepipe_idl(), topic.type, options.text());
  bus::Bus bus({options.network.domain, options.network.profile, "echo"});
  bus::SerializedReader reader(bus, topic);
  WriterNames names(bus, reader);
  base::OutputQueue output(STDOUT_FILENO);
  std::uint64_t shown = 0, left_out = 0;
  const auto started = Clock::now();
  bool reported_waiting = false;
  while (signals_received() == 0 && !output.closed() &&
         (options.count == 0 || shown < options.count)) {
    bus.wait(50ms);
    reader.take([&](const bus::SerializedSample& sample) {
      if (options.count > 0 && shown == options.count) return;
      const ShownMessage message{topic.name,
                                 names.of(sample.writer),
                                 sample.source_stamp_ns,
                                 base::now_realtime_ns(),
                                 key_change_of(sample.kind),
                                 sample.cdr};
      output.offer(text_of(message)) ? ++shown : ++left_out;
    });
    if (!reported_waiting && reader.writers() == 0 && Clock::now() - started > kWriterTimeout) {
      std::cerr << "waiting: nobody writes " << topic.name << " in domain "
                << options.network.domain
                << "; `fivepipe ls` shows who is there, Ctrl-C ends this\n";
      reported_waiting = true;
    }
  }
  finish(output);
  if (left_out > 0)
    std::cerr << base::counted(left_out, "message") << " left out: the output did not keep up\n";
  return options.count > 0 && shown < options.count && signals_received() > 0 ? 130 : 0;
}

int run_echo(const EchoOptions& options) {
  catch_signals();
  return options.file.empty() ? echo_live(options) : echo_from_file(options);
}

}  // namespace

void add_echo(CLI::App& app, Command& command) {
  auto options = std::make_shared<EchoOptions>();
  CLI::App* echo = app.add_subcommand(
      "echo", "Show a topic's messages, from the bus or a recording, as YAML or lines of JSON");
  echo->footer(
      "Examples:\n"
      "  fivepipe echo HeadPose                                 from the bus, until Ctrl-C\n"
      "  fivepipe echo CollisionResult --field d_rec_m --domain 7\n"
      "  fivepipe echo HullTile --from session.mcap --start 10 --count 3\n"
      "  fivepipe echo CameraInfo --from session.mcap --json --full | jq .message.pinhole\n\n"
      "A topic may be named by its last part, or by a regular expression that fits it alone. "
      "Behind --- stand the source's time, the writer's\n"
      "node, and how long after it the message was taken, here or by the recorder.\n"
      "Exit codes: 0 done, 1 the file is damaged or can't be read, 2 usage, no such topic or "
      "field, 130 interrupted before --count.");
  echo->add_option("TOPIC", options->topic, "HullTile, fivepipe/v1/HullTile, ..")->required();
  CLI::Option* file =
      echo->add_option("--from", options->file, "recording (MCAP); without it: the bus")
          ->check(CLI::ExistingFile);
  echo->add_option("--count", options->count, "end after so many")->check(CLI::PositiveNumber);
  const RangeOptions range = add_range_options(echo, options->start_s, options->end_s);
  range.start->needs(file);
  range.end->needs(file);
  echo->add_option("--field", options->field,
                   "this field alone: frame, region.u0_px, objects[0].object");
  echo->add_flag("--full", options->full,
                 "all values of long sequences of numbers, which are only counted otherwise");
  echo->add_flag("--json", options->json, "a line of JSON for each message");
  add_network_options(echo, options->network);
  echo->get_option("--domain")->excludes(file);
  echo->get_option("--profile")->excludes(file);
  echo->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_echo(*options); }); };
  });
}

}  // namespace fivepipe::launch
