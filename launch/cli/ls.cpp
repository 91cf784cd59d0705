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

// A participant is discovered within a second.
constexpr auto kListeningTime = 1500ms;

struct LsOptions {
  std::filesystem::path file;
  bool nodes = false;
  NetworkOptions network;
};

int run_ls(const LsOptions& options) {
  const bool of_recording = !options.file.empty();
  std::vector<ListedTopic> topics;
  if (of_recording) {
    topics = topics_of(recording::Recording(options.file));
  } else {
    bus::Bus bus({options.network.domain, options.network.profile, "ls"});
    for (const auto until = Clock::now() + kListeningTime; Clock::now() < until;) bus.wait(100ms);
    topics = topics_of(bus.endpoints());
  }
  if (topics.empty()) {
    std::cerr << (of_recording ? options.file.string() + " holds no topic\n"
                               : "nobody in domain " + std::to_string(options.network.domain) +
                                     " (profile " + options.network.profile +
                                     "); `fivepipe up` starts nodes, --domain looks elsewhere\n");
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
      "ls", "List the topics of a recording, or those on the bus, with who writes and reads them");
  ls->footer(
      "Examples:\n"
      "  fivepipe ls                       what is on the bus now, heard within 1.5 s\n"
      "  fivepipe ls --domain 7 --nodes    by node: what it writes and reads\n"
      "  fivepipe ls session.mcap\n\n"
      "Exit codes: 0 done, 1 the file can't be read, 2 usage, 3 nobody is there.");
  CLI::Option* file = ls->add_option("FILE", options->file, "recording (MCAP); without it: the bus")
                          ->check(CLI::ExistingFile);
  ls->add_flag("--nodes", options->nodes, "by node instead of by topic");
  add_network_options(ls, options->network);
  ls->get_option("--domain")->excludes(file);
  ls->get_option("--profile")->excludes(file);
  ls->callback([options, &command] {
    command = [options] { return base::report_errors([&] { return run_ls(*options); }); };
  });
}

}  // namespace fivepipe::launch
