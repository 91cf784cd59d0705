#include <chrono>
#include <iostream>

#include "common/base/usage_error.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/inspect/topic_list.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Discovery finds all participants of the domain within 1 s.
constexpr auto kDiscoveryTime = 1500ms;

struct LsOptions {
  std::filesystem::path file;
  bool nodes = false;
  NetworkOptions network;
};

int run_ls(const LsOptions& options) {
  const bool of_recording = !options.file.empty();
  std::vector<ListedTopic> topics;
  JoinedNetwork joined;
  std::string why_not_admitted;
  if (of_recording) {
    topics = topics_of(recording::Recording(options.file));
  } else {
    joined = network_from(options.network, security::Role::observer);
    bus::Bus bus({joined.domain, joined.network, "ls"});
    const auto time = kDiscoveryTime + bus::authentication_time(joined.network);
    for (const auto until = Clock::now() + time; Clock::now() < until;) bus.wait(100ms);
    topics = topics_of(bus.endpoints());
    why_not_admitted = bus.why_not_admitted();
  }
  if (topics.empty()) {
    std::cerr << (of_recording
                      ? options.file.string() + " contains no topic\n"
                      : "no participant in domain " + std::to_string(joined.domain) + " (profile " +
                            joined.network.profile + "); " +
                            (why_not_admitted.empty()
                                 ? "start nodes by `fivepipe up`, or choose another --domain"
                                 : why_not_admitted) +
                            "\n");
    return of_recording ? 0 : 3;
  }
  std::cout << (options.nodes ? nodes_text(topics, of_recording)
                              : topics_text(topics, of_recording))
            << std::flush;
  return 0;
}

}  // namespace

void add_ls(CLI::App& app, Command& command) {
  auto options = std::make_shared<LsOptions>();
  CLI::App* ls = app.add_subcommand(
      "ls", "List the topics of a recording or of the bus, with their writers and readers");
  ls->footer(
      "Examples:\n"
      "  fivepipe ls                       topics on the bus, after 1.5 s of discovery\n"
      "  fivepipe ls --domain 7 --nodes    nodes, with the topics that they write and read\n"
      "  fivepipe ls session.mcap\n\n"
      "Exit codes: 0 done, 1 the file cannot be read, 2 usage error, 3 no participant in the "
      "domain.");
  CLI::Option* file = ls->add_option("FILE", options->file, "recording (MCAP); default: the bus")
                          ->check(existing_file());
  ls->add_flag("--nodes", options->nodes, "list nodes instead of topics");
  add_network_options(ls, options->network);
  add_deployment_options(ls, options->network);
  ls->get_option("--domain")->excludes(file);
  ls->get_option("--profile")->excludes(file);
  ls->get_option("--deployment")->excludes(file);
  ls->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_ls(*options); }); };
  });
}

}  // namespace fivepipe::launch
