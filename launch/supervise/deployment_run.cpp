#include "launch/supervise/deployment_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "common/base/machine.h"
#include "common/base/realtime.h"
#include "common/base/timing.h"
#include "common/base/version.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/deployment_network.h"
#include "launch/supervise/hosts/conflict_search.h"
#include "launch/supervise/hosts/host_exchange.h"
#include "launch/supervise/hosts/hosts.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/node_programs.h"
#include "launch/supervise/recorder_process.h"
#include "launch/supervise/report.h"
#include "launch/supervise/spacing/spacing_pipe.h"
#include "launch/supervise/status/live_status.h"
#include "launch/supervise/status/status_messages.h"
#include "launch/supervise/supervisor.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// After Ctrl-C, all processes must be gone within two seconds. The grace at the end of --duration
// is longer, because closing a video may take seconds.
constexpr std::chrono::milliseconds kInterruptGrace = 1300ms, kFinishGrace = 10s;
// Time for the last frames of the footage to pass through the pipeline.
constexpr auto kDrainTime = 1s;
constexpr auto kProgressPeriod = 5s;
// --duration counts from the first composited frame, or from this time after the start if no frame
// is composited until then, because nodes first learn backgrounds and compile shaders.
constexpr auto kStartupTimeout = 20s;
constexpr auto kFinalReportTimeout = 500ms;

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

bus::Network network_for(const RunSettings& settings, const config::Deployment& deployment) {
  return node::network_of(
      deployment, {security::Role::supervisor, settings.domain, settings.host, settings.local});
}

class DeploymentRun {
 public:
  DeploymentRun(const RunSettings& settings, const config::Deployment& deployment,
                const std::vector<config::Node>& nodes, const ConflictSearch& conflicts)
      : settings_(settings),
        deployment_(deployment),
        nodes_(nodes),
        programs_(programs_of(nodes, settings, [this] { return spacing_.for_start(); })),
        conflicts_(conflicts),
        bus_({settings.domain, network_for(settings, deployment), conflicts_.participant(),
              deployment.name}),
        statuses_in_(bus_.reader<bus::topics::NodeStatus>()),
        metrics_in_(bus_.reader<bus::topics::SimulationMetrics>()),
        composited_in_(bus_.reader<bus::topics::FrameComposited>()),
        spacing_(bus_, deployment.scene),
        recorder_(settings.record.empty()
                      ? nullptr
                      : std::make_unique<RecorderProcess>(bus_, recorder_arguments(settings))),
        start_stamp_ns_(base::now_realtime_ns()),
        other_hosts_(deployment, nodes),
        host_exchange_(exchange_of_up(bus_, deployment, nodes.front().host, settings.local)),
        host_checks_(settings.any_clock),
        supervisor_(programs_, RestartSettings{}, console_output(programs_),
                    watchdog_of(settings)) {
    for (const config::Node& node : deployment.nodes) names_.insert(node.name);
    if (recorder_) names_.insert(own_recorder_name());
    for (const std::string& warning : bus_.warnings()) spdlog::warn("{}", warning);
  }

  // Returns the exit code.
  int run() {
    while (!supervisor_.all_exited()) {
      supervisor_.step(50ms);
      take_messages();
      watch_recorder();
      if (const std::string why = reason_to_stop(); !why.empty()) stop(why);
      // A second Ctrl-C kills at once.
      if (signals_received() > 0) supervisor_.stop(signals_received() > 1 ? 0ms : kInterruptGrace);
      if (!supervisor_.stopping()) print_progress();
    }
    if (stop_stamp_ns_ == 0) note_stop("every node ended");
    wait_until([this] { return all_reports_final(); });
    finish_recorder();
    write_report();
    return exit_code();
  }

 private:
  // Forwards the recorder's output and reports its end at once, because from then on nothing is
  // recorded.
  void watch_recorder() {
    if (!recorder_) return;
    recorder_->forward_output();
    if (recorder_end_ || !(recorder_end_ = recorder_->ended())) return;
    recorder_ended_after_s_ = base::seconds_since(started_);
    // --record-option=--duration can end it cleanly.
    spdlog::log(is_recording_complete() ? spdlog::level::info : spdlog::level::err,
                "the recorder ended while the deployment runs: {}; no further message is recorded",
                to_string(*recorder_end_));
  }

  void finish_recorder() {
    if (!recorder_ || recorder_end_) return;
    recorder_end_ = recorder_->finish();
    if (!recorder_end_ || recorder_end_->by_signal) return;  // it sent no final report
    wait_until([this] {
      const ProcessStatus* status = statuses_.newest(own_recorder_name());
      return status && status->final_report;
    });
  }

  bool is_recording_complete() const {
    return !recorder_ || (recorder_end_ && !recorder_end_->by_signal && recorder_end_->number == 0);
  }

  void take_messages() {
    take_statuses(statuses_in_, statuses_, names_);
    take_metrics(metrics_in_, simulations_, names_);
    for (const config::Node& node : nodes_)
      if (const ProcessStatus* newest = statuses_.newest(node.name);
          newest && newest->has_handled_frame && newest->process &&
          newest->process->host == base::host_name())
        supervisor_.mark_healthy(node.name, pid_t(newest->process->pid));
    take_composited();
    spacing_.step();
    compare_hosts();
    for (const bus::RefusedSamples& refused : bus_.take_refused())
      drops_[(refused.reason == bus::RefusedSamples::Reason::other_deployment ? "other_deployment: "
                                                                              : "too_many_keys: ") +
             refused.topic] += refused.count;
    for (const std::string& problem : bus_.problems()) spdlog::error("{}", problem);
    for (const DuplicateNode& duplicate : statuses_.duplicates())
      if (reported_duplicates_.insert(duplicate.node).second)
        spdlog::error(
            "{}. Their frames mix: another deployment runs in domain {}; stop it or choose another "
            "--domain",
            text_of(duplicate), settings_.domain);
  }

  void compare_hosts() {
    if (!host_exchange_) return;
    host_exchange_->step();
    if (stop_stamp_ns_ != 0) return;
    for (const std::string& text : host_checks_.check(
             host_exchange_->own(), host_exchange_->others(), host_exchange_->is_starting()))
      spdlog::warn("{}", text);
  }

  void take_composited() {
    for (const auto& frame : composited_in_.take()) {
      if (!frame.valid() || deployment_.viewer.name != frame->viewer) continue;
      if (const auto why = messages::why_implausible(frame->frame, frame->composited_stamp_ns)) {
        ++drops_[messages::text_of({"bad_composited", frame->viewer, *why})];
        continue;
      }
      newest_composited_seen_ = Clock::now();
      if (first_composited_seen_) continue;
      // By the clock of this host.
      first_composited_stamp_ns_ = frame.arrived_ns();
      first_composited_seen_ = newest_composited_seen_;
    }
  }

  // Ignores spectators.
  bool all_exited_cleanly(const std::string& program) const {
    bool any = false;
    for (const config::Node& node : nodes_)
      if (config::program_of(node) == program && !config::spectator_of(node)) {
        any = true;
        if (!supervisor_.exited_cleanly(node.name)) return false;
      }
    return any;
  }

  bool renders() const {
    return std::any_of(nodes_.begin(), nodes_.end(), config::draws_for_viewer);
  }
  bool is_own(const config::Node& node) const {  // it runs on this host
    return std::ranges::count(nodes_, node.name, &config::Node::name) > 0;
  }
  bool duration_is_over() const {
    if (!(settings_.duration_s > 0)) return false;
    const auto counts_from = first_composited_seen_ ? *first_composited_seen_
                             : renders()            ? started_ + kStartupTimeout
                                                    : started_;
    return Clock::now() - counts_from >= std::chrono::duration<double>(settings_.duration_s);
  }

  // Returns why the run ends now; empty if it continues or already stops.
  std::string reason_to_stop() {
    if (stop_stamp_ns_ != 0) return "";
    if (supervisor_.failure())
      return supervisor_.failure()->node + " " + supervisor_.failure()->reason;
    if (signals_received() > 0) return std::string("SIG") + sigabbrev_np(newest_signal());
    if (const std::string why = conflicts_.find(bus_); !why.empty()) return why;
    if (!host_checks_.refusal().empty()) return host_checks_.refusal();
    if (duration_is_over()) return "duration";
    if (all_exited_cleanly("render_node")) return "every render_node ended";
    if (!all_exited_cleanly("capture_node")) return "";
    if (!input_ended_) input_ended_ = Clock::now();
    return Clock::now() - *input_ended_ >= kDrainTime ? "every capture_node ended" : "";
  }

  const std::string& refusal() const {
    return conflicts_.refusal().empty() ? host_checks_.refusal() : conflicts_.refusal();
  }

  void stop(const std::string& why) {
    note_stop(why);
    const bool at_once = signals_received() > 0 || !refusal().empty();
    supervisor_.stop(at_once ? kInterruptGrace : kFinishGrace);
  }

  void note_stop(const std::string& why) {
    stop_stamp_ns_ = base::now_realtime_ns();
    ended_by_ = why;
  }

  // Prints the status line periodically, and at once when rendering has stopped.
  void print_progress() {
    const bool stalled = newest_composited_seen_ && base::seconds_since(*newest_composited_seen_) >
                                                        max_frame_gap_s(deployment_.frame_rate_hz);
    const bool was_stalled = std::exchange(rendering_stalled_, stalled);
    if (Clock::now() < next_progress_ && (was_stalled || !stalled)) return;
    while (next_progress_ <= Clock::now()) next_progress_ += kProgressPeriod;
    Progress progress;
    progress.elapsed_s = base::seconds_since(started_);
    progress.frame_rate_hz = deployment_.frame_rate_hz;
    progress.composited = frames_composited(statuses_);
    for (const config::Node& node : deployment_.nodes) {
      if (config::draws_for_viewer(node)) progress.render_nodes.push_back(node.name);
      if (!supervisor_.exited_cleanly(node.name) &&
          !other_hosts_.is_on_missing_host(node, statuses_))
        progress.expected.push_back(node.name);
      if (!is_own(node)) progress.other_hosts[node.name] = node.host;
    }
    if (recorder_ && !(recorder_end_ && is_recording_complete()))
      progress.expected.push_back(own_recorder_name());
    progress.missing_hosts = other_hosts_.missing(statuses_);
    if (newest_composited_seen_)
      progress.newest_frame_age_s = base::seconds_since(*newest_composited_seen_);
    spdlog::info("{}", progress_line(progress, statuses_, arrival_clock_ns()));
  }

  // Final statuses of processes that exited cleanly may arrive after their end. Takes messages
  // until the condition holds, for at most kFinalReportTimeout.
  template <class Condition>
  void wait_until(const Condition& holds) {
    const auto until = Clock::now() + kFinalReportTimeout;
    for (take_messages(); !holds() && Clock::now() < until; take_messages()) bus_.wait(20ms);
  }
  bool all_reports_final() const {
    const auto processes = statuses_.processes();
    return std::all_of(nodes_.begin(), nodes_.end(), [&](const config::Node& node) {
      if (std::ranges::count(supervisor_.killed(), node.name) > 0 ||
          std::ranges::count(supervisor_.crashed_while_stopping(), node.name) > 0)
        return true;  // it sends no final report
      const auto of_node = processes.find(node.name);
      return of_node == processes.end() || of_node->second.back().final_report;
    });
  }

  ReportInput report_input() const {
    ReportInput input;
    input.version = base::version();
    input.commit = base::commit();
    input.build_type = base::build_type();
    input.cpu = base::cpu_name();
    input.cores = base::core_count();
    if (!settings_.every_frame) input.requested_rate_hz = deployment_.frame_rate_hz;
    input.deployment = settings_.deployment;
    input.start_stamp_ns = start_stamp_ns_;
    input.stop_stamp_ns = stop_stamp_ns_;
    input.first_composited_stamp_ns = first_composited_stamp_ns_;
    input.ended_by = ended_by_;
    input.programs = supervisor_.history();
    // The nodes of other hosts are known by their statuses alone.
    for (const config::Node& node : deployment_.nodes)
      if (!is_own(node))
        input.programs.push_back({node.name, config::program_of(node), {}, node.host});
    if (recorder_)
      input.recorder = {settings_.record,
                        own_recorder_name(),
                        recorder_->pid(),
                        recorder_end_ ? to_string(*recorder_end_) : "did not end on SIGKILL",
                        is_recording_complete(),
                        recorder_ended_after_s_};
    input.statuses = statuses_;
    input.simulations = simulations_;
    input.drops = drops_;
    if (host_exchange_) input.hosts = host_exchange_->others();
    return input;
  }

  void write_report() const {
    const nlohmann::json report = report_from(report_input());
    const std::filesystem::path file = settings_.out / "report.json";
    std::ofstream written(file);
    written << report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n'
            << std::flush;
    if (!written)
      throw std::runtime_error("cannot write " + file.string() + ": " + std::strerror(errno));
    std::cout << table_of(report) << "report: " << file.string()
              << ", logs: " << (settings_.out / "log").string() << "/\n"
              << std::flush;
  }

  int exit_code() const {
    if (const auto& failure = supervisor_.failure()) {
      std::cerr << failure->node << " " << failure->reason << "\nIts last output:\n";
      for (const std::string& line : failure->last_lines) std::cerr << "  " << line << '\n';
      return failure->exit_code;
    }
    if (!refusal().empty()) {
      std::cerr << refusal() << '\n';
      return 2;
    }
    if (!is_recording_complete()) return 1;  // the table of the report states why
    if (signals_received() > 0) return 130;
    if (!supervisor_.killed().empty() || !supervisor_.crashed_while_stopping().empty()) return 1;
    if (!renders() || frames_composited(statuses_) > 0) return 0;
    std::cerr << "no frame was composited; see the logs in " << (settings_.out / "log").string()
              << "/\n";
    return 1;
  }

  const RunSettings& settings_;
  const config::Deployment& deployment_;
  const std::vector<config::Node>& nodes_;
  std::vector<Program> programs_;
  std::set<std::string> names_, reported_duplicates_;  // names_: whose statuses count
  ConflictSearch conflicts_;
  bus::Bus bus_;
  bus::Reader<bus::topics::NodeStatus> statuses_in_;
  bus::Reader<bus::topics::SimulationMetrics> metrics_in_;
  bus::Reader<bus::topics::FrameComposited> composited_in_;
  SpacingPipe spacing_;
  StatusRegistry statuses_;
  SimulationRegistry simulations_;
  std::map<std::string, std::uint64_t> drops_;
  std::unique_ptr<RecorderProcess> recorder_;  // starts before the first node
  std::optional<ProcessExit> recorder_end_;
  std::optional<double> recorder_ended_after_s_;  // if it ended before the deployment
  std::int64_t start_stamp_ns_ = 0, stop_stamp_ns_ = 0;
  std::optional<std::int64_t> first_composited_stamp_ns_;
  std::string ended_by_;
  Clock::time_point started_ = Clock::now(), next_progress_ = started_ + kProgressPeriod;
  std::optional<Clock::time_point> input_ended_, first_composited_seen_, newest_composited_seen_;
  bool rendering_stalled_ = false;
  OtherHosts other_hosts_;
  std::unique_ptr<HostExchange> host_exchange_;  // nullptr: the deployment has one host
  HostChecks host_checks_;
  Supervisor supervisor_;
};

}  // namespace

int run_deployment(const RunSettings& settings, const config::Deployment& deployment,
                   const std::vector<config::Node>& nodes) {
  ConflictSearch conflicts(deployment.name, nodes.empty() ? "" : nodes.front().host,
                           settings.domain);
  const bus::Network network = network_for(settings, deployment);
  // On one machine, discovery would delay the first picture, and NodeClaims refuses most conflicts.
  if (bus::reaches_other_machines(network.profile) &&
      !conflicts.find_before_start(network).empty()) {
    std::cerr << conflicts.refusal() << '\n';
    return 2;
  }
  return DeploymentRun(settings, deployment, nodes, conflicts).run();
}

}  // namespace fivepipe::launch
