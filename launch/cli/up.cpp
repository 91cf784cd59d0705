#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/machine.h"
#include "common/base/realtime.h"
#include "common/base/version.h"
#include "common/config/deployment.h"
#include "common/recording/replay/recorder.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/node_claims.h"
#include "launch/supervise/recorder_process.h"
#include "launch/supervise/report.h"
#include "launch/supervise/status_messages.h"
#include "launch/supervise/supervisor.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Ctrl-C must have everything gone within two seconds; at the end of --duration nobody waits, and a
// video may take long to close.
constexpr std::chrono::milliseconds kInterruptGrace = 1300ms, kFinishGrace = 10s;
// What the last frames of footage need to pass through the pipeline.
constexpr auto kDrainTime = 1s;
constexpr auto kProgressPeriod = 5s;
// Reference images and shaders come first: --duration counts from the first composited frame, at
// the latest from here.
constexpr auto kStartupTimeout = 20s;
constexpr auto kFinalReportTimeout = 500ms;

struct UpOptions {
  std::filesystem::path deployment, out;
  std::string host;
  std::filesystem::path record;  // recording; empty: none
  std::vector<std::string> record_options;
  double duration_s = 0;  // from the first composited frame; 0: until interrupted
  std::vector<std::string> settings;
  std::optional<std::uint32_t> domain;
};

// Nodes without a host run wherever `up` is called without --host.
std::vector<config::Node> nodes_of_host(const config::Deployment& deployment,
                                        const std::string& asked_host) {
  const std::string host = asked_host.empty() ? base::host_name() : asked_host;
  std::vector<config::Node> here;
  std::set<std::string> hosts;
  for (const config::Node& node : deployment.nodes) {
    if (!node.host.empty()) hosts.insert(node.host);
    if (node.host.empty() ? asked_host.empty() : node.host == host) here.push_back(node);
  }
  if (!here.empty()) return here;
  std::string known;
  for (const std::string& name : hosts) known += " " + name;
  throw config::ConfigError({{deployment.file, 0, 0,
                              "no node for host '" + host + "'; the deployment's hosts:" +
                                  (known.empty() ? " none" : known) + " (choose with --host)"}});
}

std::vector<Program> programs_of(const std::vector<config::Node>& nodes, const UpOptions& options,
                                 std::uint32_t domain) {
  std::vector<Program> programs;
  for (const config::Node& node : nodes) {
    Program program{node.name,
                    {program_folder() / config::program_of(node)},
                    node.cores,
                    options.out / "log" / (node.name + ".log")};
    program.argv.insert(program.argv.end(),
                        {"--deployment", options.deployment, "--node", node.name, "--out",
                         options.out, "--domain", std::to_string(domain)});
    for (const std::string& setting : options.settings)
      program.argv.insert(program.argv.end(), {"--set", setting});
    programs.push_back(std::move(program));
  }
  return programs;
}

SupervisorOutput console_output(const std::vector<Program>& programs) {
  std::size_t width = 0;
  for (const Program& program : programs) width = std::max(width, program.name.size());
  return {.line =
              [width](const std::string& node, const std::string& line) {
                std::cerr << '[' << node << ']' << std::string(width - node.size() + 1, ' ') << line
                          << '\n';
              },
          .event = [](const std::string& text) { spdlog::warn("{}", text); }};
}

// One run of `up`, from the first process to the report.
class Run {
 public:
  Run(const UpOptions& options, const config::Deployment& deployment,
      const std::vector<config::Node>& nodes, std::uint32_t domain)
      : options_(options),
        deployment_(deployment),
        nodes_(nodes),
        domain_(domain),
        programs_(programs_of(nodes, options, domain)),
        bus_({domain, deployment.network_profile}),
        statuses_in_(bus_.reader<bus::topics::NodeStatus>()),
        composited_in_(bus_.reader<bus::topics::FrameComposited>()),
        recorder_(started_recorder()),
        start_stamp_ns_(base::now_realtime_ns()),
        supervisor_(programs_, RestartSettings{}, console_output(programs_)) {
    for (const config::Node& node : deployment.nodes) node_names_.insert(node.name);
    for (const std::string& warning : bus_.warnings()) spdlog::warn("{}", warning);
  }

  int operator()() {
    while (!supervisor_.all_exited()) {
      supervisor_.step(50ms);
      take_messages();
      if (recorder_) recorder_->forward_output();
      if (const std::string why = reason_to_stop(); !why.empty()) stop(why);
      if (signals_received() > 0)
        supervisor_.stop(signals_received() > 1 ? 0ms
                                                : kInterruptGrace);  // a second Ctrl-C: at once
      if (!supervisor_.stopping()) print_progress();
    }
    if (stop_stamp_ns_ == 0) note_stop("every node ended");
    wait_for_final_reports();
    if (recorder_) recorder_exit_code_ = recorder_->finish();
    write_report();
    return exit_code();
  }

 private:
  void take_messages() {
    take_statuses(statuses_in_, statuses_, node_names_);
    for (const auto& [name, processes] : statuses_.processes())
      if (processes.back().has_handled_frame)
        supervisor_.mark_healthy(name, processes.back().start_stamp_ns);
    for (const auto& frame : composited_in_.take())
      if (frame.valid() && !first_composited_stamp_ns_) {
        first_composited_stamp_ns_ = frame->composited_stamp_ns;
        first_composited_seen_ = Clock::now();
      }
    for (const std::string& problem : bus_.problems()) spdlog::error("{}", problem);
    for (const std::string& name : statuses_.duplicates())
      if (doubled_said_.insert(name).second)
        spdlog::error(
            "two processes publish as node '{}': another deployment runs in this domain; their "
            "frames mix",
            name);
  }

  bool all_exited_cleanly(const std::string& program) const {
    bool any = false;
    for (const config::Node& node : nodes_)
      if (config::program_of(node) == program) {
        any = true;
        if (!supervisor_.exited_cleanly(node.name)) return false;
      }
    return any;
  }

  bool renders() const {
    return std::any_of(nodes_.begin(), nodes_.end(), [](const config::Node& node) {
      return config::program_of(node) == "render_node";
    });
  }

  bool duration_is_over() const {
    if (!(options_.duration_s > 0)) return false;
    const auto counts_from = first_composited_seen_ ? *first_composited_seen_
                             : renders()            ? started_ + kStartupTimeout
                                                    : started_;
    return Clock::now() - counts_from >= std::chrono::duration<double>(options_.duration_s);
  }

  // Empty: go on.
  std::string reason_to_stop() {
    if (stop_stamp_ns_ != 0) return "";
    if (supervisor_.failure())
      return supervisor_.failure()->node + " " + supervisor_.failure()->reason;
    if (signals_received() > 0) return std::string("SIG") + sigabbrev_np(newest_signal());
    if (duration_is_over()) return "duration";
    if (all_exited_cleanly("render_node")) return "every render_node ended";
    if (!all_exited_cleanly("capture_node")) return "";
    if (!input_ended_) input_ended_ = Clock::now();
    return Clock::now() - *input_ended_ >= kDrainTime ? "every capture_node ended" : "";
  }

  void stop(const std::string& why) {
    note_stop(why);
    supervisor_.stop(signals_received() > 0 ? kInterruptGrace : kFinishGrace);
  }

  void note_stop(const std::string& why) {
    stop_stamp_ns_ = base::now_realtime_ns();
    ended_by_ = why;
  }

  void print_progress() {
    if (Clock::now() < next_progress_) return;
    next_progress_ += kProgressPeriod;
    const double elapsed_s = std::chrono::duration<double>(Clock::now() - started_).count();
    double rate_hz = 0;
    for (const config::Node& node : nodes_)
      if (const auto processes = statuses_.processes();
          config::program_of(node) == "render_node" && processes.contains(node.name))
        rate_hz = processes.at(node.name).back().frame_rate_hz;
    spdlog::info("{:.0f} s: {} frames composited, now {:.1f} frames/s", elapsed_s,
                 frames_composited(statuses_), rate_hz);
  }

  // The last statuses of processes that ended in order may still be on their way.
  void wait_for_final_reports() {
    const auto until = Clock::now() + kFinalReportTimeout;
    while (Clock::now() < until && !all_reports_final()) {
      bus_.wait(20ms);
      take_messages();
    }
  }
  bool all_reports_final() const {
    const auto processes = statuses_.processes();
    const auto is_in = [](const std::vector<std::string>& names, const std::string& name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    return std::all_of(nodes_.begin(), nodes_.end(), [&](const config::Node& node) {
      if (is_in(supervisor_.killed(), node.name) ||
          is_in(supervisor_.crashed_while_stopping(), node.name))
        return true;  // none will come
      const auto of_node = processes.find(node.name);
      return of_node == processes.end() || of_node->second.back().final_report;
    });
  }

  void write_report() {
    ReportInput input;
    input.version = base::version();
    input.commit = base::commit();
    input.build_type = base::build_type();
    input.cpu = base::cpu_name();
    input.cores = base::core_count();
    input.deployment = options_.deployment;
    input.start_stamp_ns = start_stamp_ns_;
    input.stop_stamp_ns = stop_stamp_ns_;
    input.first_composited_stamp_ns = first_composited_stamp_ns_;
    input.ended_by = ended_by_;
    input.programs = supervisor_.history();
    for (const config::Node& node :
         deployment_.nodes)  // those of other hosts: known by their statuses alone
      if (std::none_of(nodes_.begin(), nodes_.end(),
                       [&](const config::Node& ours) { return ours.name == node.name; }))
        input.programs.push_back({node.name, config::program_of(node), {}});
    input.statuses = statuses_;
    const nlohmann::json report = report_from(input);
    const std::filesystem::path file = options_.out / "report.json";
    std::ofstream written(file);
    written << report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n'
            << std::flush;
    if (!written)
      throw std::runtime_error(file.string() + " can't be written: " + std::strerror(errno));
    std::cout << table_of(report) << "report: " << file.string()
              << ", logs: " << (options_.out / "log").string() << "/\n"
              << std::flush;
  }

  int exit_code() const {
    if (const auto& failure = supervisor_.failure()) {
      std::cerr << failure->node << " " << failure->reason << "\nThe last it said:\n";
      for (const std::string& line : failure->last_lines) std::cerr << "  " << line << '\n';
      return failure->exit_code;
    }
    if (recorder_exit_code_ != 0)
      std::cerr << "the recording is not complete: exit code " << recorder_exit_code_
                << " of the recorder\n";
    if (signals_received() > 0) return 130;
    if (recorder_exit_code_ != 0) return 1;
    if (!supervisor_.killed().empty() || !supervisor_.crashed_while_stopping().empty()) return 1;
    if (!renders() || frames_composited(statuses_) > 0) return 0;
    std::cerr << "no frame was composited\n";
    return 1;
  }

  std::unique_ptr<RecorderProcess> started_recorder() {
    if (options_.record.empty()) return nullptr;
    std::vector<std::string> arguments{"-o",           options_.record,
                                       "--deployment", options_.deployment,
                                       "--domain",     std::to_string(domain_)};
    for (const std::string& setting : options_.settings)
      arguments.insert(arguments.end(), {"--set", setting});
    arguments.insert(arguments.end(), options_.record_options.begin(),
                     options_.record_options.end());
    return std::make_unique<RecorderProcess>(bus_, arguments);
  }

  const UpOptions& options_;
  const config::Deployment& deployment_;
  const std::vector<config::Node>& nodes_;
  const std::uint32_t domain_;
  std::vector<Program> programs_;
  std::set<std::string> node_names_, doubled_said_;
  bus::Bus bus_;
  bus::Reader<bus::topics::NodeStatus> statuses_in_;
  bus::Reader<bus::topics::FrameComposited> composited_in_;
  StatusRegistry statuses_;
  std::unique_ptr<RecorderProcess> recorder_;  // before the first node
  int recorder_exit_code_ = 0;
  std::int64_t start_stamp_ns_ = 0, stop_stamp_ns_ = 0;
  std::optional<std::int64_t> first_composited_stamp_ns_;
  std::string ended_by_;
  Clock::time_point started_ = Clock::now(), next_progress_ = started_ + kProgressPeriod;
  std::optional<Clock::time_point> input_ended_, first_composited_seen_;
  Supervisor supervisor_;
};

// --record-option=--force is for the recorder, but it is better refused before anything is started.
std::string recording_refused(const UpOptions& options) {
  const auto& given = options.record_options;
  if (options.record.empty() || std::find(given.begin(), given.end(), "--force") != given.end())
    return "";
  const std::string why = replay::refusal_to_overwrite(options.record);
  return why.empty() ? "" : why + " (--record-option=--force)";
}

int run_up(UpOptions options) {
  if (const std::string why = recording_refused(options); !why.empty()) {
    std::cerr << why << '\n';
    return 2;
  }
  const config::Deployment deployment =
      config::load_deployment(options.deployment, settings_from(options.settings));
  const std::vector<config::Node> nodes = nodes_of_host(deployment, options.host);
  const std::uint32_t domain = options.domain.value_or(deployment.domain);
  if (options.out.empty()) options.out = std::filesystem::path("out") / deployment.name;
  std::filesystem::create_directories(options.out);
  // What an earlier run left must not pass for this one's.
  for (const auto& entry : std::filesystem::directory_iterator(options.out))
    if (const std::string name = entry.path().filename();
        name == "report.json" || name.starts_with("composite"))
      std::filesystem::remove(entry.path());
  if (std::string(base::build_type()) != "Release")
    spdlog::warn("this is a {} build: expect it to be slow", base::build_type());
  for (const std::string& doubt : config::mesh_size_warnings(deployment.scene))
    spdlog::warn("{}", doubt);

  std::vector<std::string> names;
  for (const config::Node& node : nodes) names.push_back(node.name);
  std::optional<NodeClaims> claims;
  try {
    claims.emplace(domain, names);
  } catch (const NodeNameTaken& taken) {
    std::cerr << taken.what() << '\n';
    return 2;
  }
  // llvmpipe starts a thread per core in every process that draws; several such processes on few
  // cores then wait for one another.
  setenv("LP_NUM_THREADS", "1", 0);
  catch_signals();
  return Run(options, deployment, nodes, domain)();
}

}  // namespace

void add_up(CLI::App& app, Command& command) {
  auto options = std::make_shared<UpOptions>();
  CLI::App* up = app.add_subcommand(
      "up",
      "Start the nodes of a deployment and supervise them until --duration is over or Ctrl-C");
  up->footer(
      "Examples:\n"
      "  fivepipe up launch/deployments/demo.yaml --duration 10 --out out/demo\n"
      "  fivepipe up launch/deployments/demo.yaml --record out/session.mcap\n"
      "  fivepipe up launch/deployments/seated4cam.yaml --set data=/data/seated4cam\n\n"
      "Exit codes: 0 done, 1 a node failed, 2 usage or configuration, 3 hardware missing, 130 "
      "interrupted.");
  up->add_option("DEPLOYMENT", options->deployment, "deployment file (YAML)")->required();
  up->add_option(
      "--host", options->host,
      "start the nodes of this host; without it: this machine's name, and nodes that name no host");
  up->add_option("--duration", options->duration_s,
                 "seconds from the first composited frame; without it: until Ctrl-C")
      ->check(CLI::PositiveNumber);
  up->add_option(
      "--out", options->out,
      "folder for composites, report.json and log/; without it: out/NAME of the deployment");
  add_set_option(up, options->settings);
  up->add_option("--record", options->record,
                 "also record everything into this MCAP file (fivepipe record)");
  up->add_option(
        "--record-option", options->record_options,
        "an option for the recorder: --record-option=--no-colour; may be given several times")
      ->allow_extra_args(false);
  up->add_option("--domain", options->domain, "DDS domain instead of the deployment's")
      ->check(CLI::Range(0, 230));
  up->callback([options, &command] { command = [options] { return run_up(*options); }; });
}

}  // namespace fivepipe::launch
