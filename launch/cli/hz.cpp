#include "launch/inspect/hz.h"

#include "common/base/usage_error.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

struct HzOptions {
  HzRequest request;
  NetworkOptions network;
};

int run_hz(const HzOptions& options) {
  HzRequest request = options.request;
  if (request.file.empty()) {
    const JoinedNetwork joined = network_from(options.network, security::Role::observer);
    request.domain = joined.domain;
    request.network = joined.network;
  }
  catch_signals();
  return measure_rate(request, [] { return signals_received() > 0; });
}

}  // namespace

void add_hz(CLI::App& app, Command& command) {
  auto options = std::make_shared<HzOptions>();
  HzRequest& request = options->request;
  CLI::App* hz =
      app.add_subcommand("hz", "Measure rate, intervals and latencies of a topic, by writer");
  hz->footer(
      "Examples:\n"
      "  fivepipe hz HeadPose                       from the bus, a table per second until Ctrl-C\n"
      "  fivepipe hz HullTile --domain 7 --once 10\n"
      "  fivepipe hz ObjectPixelMap --from session.mcap\n\n"
      "An interval is the time between two messages at their receiver: hz or the recorder. A "
      "latency is the time from the source's timestamp to the receiver.\n"
      "Exit codes: 0 done, 1 the file is damaged or cannot be read, 2 usage error, 3 no message "
      "within --once, 130 interrupted before the result.");
  hz->add_option("TOPIC", request.topic, "HullTile, fivepipe/v1/HullTile, ..")->required();
  CLI::Option* file = hz->add_option("--from", request.file, "recording (MCAP); default: the bus")
                          ->check(existing_file());
  hz->add_option("--once", request.once_s, "print one table over this number of seconds and quit")
      ->check(CLI::Range(0.1, 86400.0))
      ->excludes(file);
  add_network_options(hz, options->network);
  add_deployment_options(hz, options->network);
  hz->get_option("--domain")->excludes(file);
  hz->get_option("--profile")->excludes(file);
  hz->get_option("--deployment")->excludes(file);
  hz->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_hz(*options); }); };
  });
}

}  // namespace fivepipe::launch
