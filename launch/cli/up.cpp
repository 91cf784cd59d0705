#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <optional>

#include "common/base/usage_error.h"
#include "common/base/version.h"
#include "common/config/deployment.h"
#include "common/recording/replay/recorder.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/claims.h"
#include "launch/supervise/deployment_run.h"
#include "launch/supervise/hosts/hosts.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::launch {
namespace {

struct UpOptions {
  RunSettings run;
  std::optional<std::uint32_t> domain;
  bool without_watchdog = false;
};

// The recorder checks --record-option=--force itself, but only after the nodes have started.
std::string why_not_recordable(const RunSettings& run) {
  const auto& given = run.record_options;
  if (run.record.empty() || std::find(given.begin(), given.end(), "--force") != given.end())
    return "";
  const std::string why = replay::refusal_to_overwrite(run.record);
  return why.empty() ? "" : why + " (--record-option=--force)";
}

// Throws base::UsageError if the folder cannot be made or written to.
void make_folder(const std::filesystem::path& out) {
  std::error_code error;
  std::filesystem::create_directories(out, error);
  if (error)
    throw base::UsageError("--out " + out.string() +
                           ": cannot create the folder: " + error.message() + "; choose another");
  if (access(out.c_str(), W_OK | X_OK) != 0)
    throw base::UsageError("--out " + out.string() + ": cannot write to the folder: " +
                           std::strerror(errno) + "; choose another");
}

// Removes the results of an earlier run, which could pass for those of this one.
void clear_results(const std::filesystem::path& out) {
  for (const auto& entry : std::filesystem::directory_iterator(out))
    if (const std::string name = entry.path().filename();
        name == "report.json" || name.starts_with("composite"))
      std::filesystem::remove(entry.path());
}

int run_up(UpOptions options) {
  RunSettings& run = options.run;
  run.deployment = deployment_file(run.deployment);
  run.watchdog = !options.without_watchdog;
  if (const std::string why = why_not_recordable(run); !why.empty()) {
    std::cerr << why << '\n';
    return 2;
  }
  const config::Deployment deployment =
      config::load_deployment(run.deployment, settings_from(run.settings));
  const std::vector<config::Node> nodes =
      run.local ? deployment.nodes : nodes_of_host(deployment, run.host);
  run.domain = options.domain.value_or(deployment.domain);
  if (run.out.empty()) run.out = std::filesystem::path("out") / deployment.name;
  if (std::string(base::build_type()) != "Release")
    spdlog::warn("this is a {} build, which is many times slower than Release", base::build_type());
  if (run.local && deployment.security)
    spdlog::warn("--local: the nodes use the loopback interface, without security");
  for (const std::string& warning :
       config::mesh_warnings(deployment.scene, deployment.rig.volume_m))
    spdlog::warn("{}", warning);
  for (const std::string& warning : config::material_warnings(deployment.scene))
    spdlog::warn("{}", warning);

  std::vector<std::string> names;
  for (const config::Node& node : nodes) names.push_back(node.name);
  std::optional<NodeClaims> claims;
  std::optional<FolderClaim> folder;
  try {
    claims.emplace(run.domain, names);
    make_folder(run.out);
    folder.emplace(run.out);
  } catch (const ClaimRefused& refused) {
    std::cerr << refused.what() << '\n';
    return 2;
  }
  catch_signals();
  if (!folder->warning().empty()) spdlog::warn("{}", folder->warning());
  // The claims come first: a running deployment may be writing to this folder.
  clear_results(run.out);
  // llvmpipe starts one thread per core in every process that draws. On few cores, several such
  // processes would wait for one another.
  setenv("LP_NUM_THREADS", "1", 0);
  return run_deployment(run, deployment, nodes);
}

}  // namespace

void add_up(CLI::App& app, Command& command) {
  auto options = std::make_shared<UpOptions>();
  RunSettings& run = options->run;
  CLI::App* up = app.add_subcommand(
      "up",
      "Start the nodes of a deployment and supervise them until --duration is over or Ctrl-C.\n"
      "Restarts nodes that die. Continues if a pager or `head` closes its output.");
  up->footer(
      "Examples:\n"
      "  fivepipe up launch/deployments/demo.yaml --duration 10 --out out/demo\n"
      "  fivepipe up launch/deployments/demo.yaml --record out/session.mcap\n"
      "  fivepipe up launch/deployments/seated4cam.yaml --set data=/data/seated4cam\n"
      "  fivepipe up launch/deployments/paper_files.yaml --set images=out/images --every-frame\n\n"
      "Exit codes: 0 done; 1 a node failed or was killed, no frame was composited, or the\n"
      "recording is incomplete; 2 usage or configuration, keys that expire, the clock of\n"
      "another host, or another deployment runs in this domain or writes to this folder;\n"
      "3 hardware missing; 130 interrupted.");
  up->add_option(
        "DEPLOYMENT", run.deployment,
        "deployment file (YAML), or the name of one that comes with fivepipe, such as demo")
      ->required();
  CLI::Option* const host = up->add_option(
      "--host", run.host,
      "start the nodes of this host (default: the host with this machine's name or one "
      "of its addresses; without `hosts` in the deployment, also the nodes without a "
      "host)");
  up->add_flag("--local", run.local,
               "start the nodes of all hosts on this machine, over the loopback interface")
      ->excludes(host);
  up->add_option("--duration", run.duration_s,
                 "seconds from the first composited frame, or from 20 s after the start if none is "
                 "composited until then; from the start without a render_node (default: until "
                 "Ctrl-C)")
      ->check(CLI::PositiveNumber);
  up->add_option(
      "--out", run.out,
      "folder for composites, report.json and log/ (default: out/NAME of the "
      "deployment); `up` first deletes report.json and composite* of an earlier run there");
  add_set_option(up, run.settings);
  up->add_flag("--every-frame", run.every_frame,
               "process every frame of the files, without a clock, as fast as the nodes can, and "
               "end with the files");
  up->add_flag("--allow-clock-offset", run.any_clock,
               "run although the clock of another host differs by more than 20 ms");
  up->add_flag("--no-watchdog", options->without_watchdog,
               "do not kill and restart a stalled node; for a debugger that stops it");
  up->add_option("--record", run.record,
                 "also record all topics into this MCAP file, as fivepipe record does");
  up->add_option("--record-option", run.record_options,
                 "option for the recorder, such as --record-option=--no-colour; repeatable")
      ->allow_extra_args(false);
  up->add_option("--domain", options->domain, "DDS domain (default: the deployment's)")
      ->check(CLI::Range(0, config::kMaxDomain));
  up->callback([options, &command] { command = [options] { return run_up(*options); }; });
}

}  // namespace fivepipe::launch
