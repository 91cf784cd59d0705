#include "launch/inspect/echo.h"

#include "common/base/usage_error.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

struct EchoOptions {
  EchoRequest request;
  std::string field;
  NetworkOptions network;
};

int run_echo(const EchoOptions& options) {
  EchoRequest request = options.request;
  if (!options.field.empty()) request.text.field = FieldPath(options.field);
  if (request.file.empty()) {
    const JoinedNetwork joined = network_from(options.network, security::Role::observer);
    request.domain = joined.domain;
    request.network = joined.network;
  }
  catch_signals();
  return echo(request, [] { return signals_received() > 0; });
}

}  // namespace

void add_echo(CLI::App& app, Command& command) {
  auto options = std::make_shared<EchoOptions>();
  EchoRequest& request = options->request;
  CLI::App* echo = app.add_subcommand(
      "echo", "Print the messages of a topic, from the bus or a recording, as YAML or JSON lines");
  echo->footer(
      "Examples:\n"
      "  fivepipe echo HeadPose                                 from the bus, until Ctrl-C\n"
      "  fivepipe echo CollisionResult --field d_rec_m --domain 7\n"
      "  fivepipe echo HullTile --from session.mcap --start 10 --count 3\n"
      "  fivepipe echo CameraInfo --from session.mcap --json --full | jq .message.pinhole\n"
      "  fivepipe echo VirtualState --from session.mcap --json --full --hex --bare | sort\n"
      "                                                         exact values, to compare two "
      "recordings\n\n"
      "TOPIC is a topic's name, the last part of its name, or a regular expression that matches "
      "one topic; echo ignores its letter case. The line with --- shows when the source\n"
      "sent the message, the writer's node, and the latency until echo or the recorder received "
      "it.\n"
      "Exit codes: 0 done, 1 the file is damaged or cannot be read, 2 usage error, unknown topic "
      "or field, 130 interrupted before --count.");
  echo->add_option("TOPIC", request.topic, "HullTile, fivepipe/v1/HullTile, ..")->required();
  CLI::Option* file = echo->add_option("--from", request.file, "recording (MCAP); default: the bus")
                          ->check(existing_file());
  echo->add_option("--count", request.count, "quit after this number of messages")
      ->check(CLI::PositiveNumber);
  const RangeOptions range = add_range_options(echo, request.start_s, request.end_s);
  range.start->needs(file);
  range.end->needs(file);
  echo->add_option("--field", options->field,
                   "print only this field: frame, region.u0_px, objects[0].object");
  echo->add_flag("--full", request.text.full,
                 "print all values of long sequences of numbers; default: only their length");
  echo->add_flag("--json", request.text.json, "print one line of JSON per message");
  echo->add_flag("--hex", request.text.hex,
                 "print floating-point numbers exactly, in hexadecimal (0x1.8p+1)");
  echo->add_flag("--bare", request.text.bare,
                 "print values only: no writers, no times, no key changes");
  add_network_options(echo, options->network);
  add_deployment_options(echo, options->network);
  echo->get_option("--domain")->excludes(file);
  echo->get_option("--profile")->excludes(file);
  echo->get_option("--deployment")->excludes(file);
  echo->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_echo(*options); }); };
  });
}

}  // namespace fivepipe::launch
