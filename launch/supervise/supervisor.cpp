#include "launch/supervise/supervisor.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <system_error>
#include <utility>

#include "common/base/output_queue.h"
#include "common/base/realtime.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kFailureLogLines = 15;
constexpr auto kFailureGrace = 1500ms;
constexpr double kDispensableDelay_s = 30;  // at most, between failed starts of a dispensable node

std::string seconds(double s) {
  char text[32];
  std::snprintf(text, sizeof text, "%g s", s);
  return text;
}

std::vector<int> missing_cores(const std::vector<int>& cores) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::vector<int> missing;
  std::copy_if(cores.begin(), cores.end(), std::back_inserter(missing), [&](int core) {
    return core < 0 || core >= CPU_SETSIZE || !CPU_ISSET(core, &allowed);
  });
  return missing;
}

bool is_expected_after_stop(const ProcessExit& exit) {
  return exit.by_signal ? exit.number == SIGTERM : exit.number == 0 || exit.number == 130;
}

}  // namespace

// A thread writes the file, so that a slow disk does not delay the supervision.
class Supervisor::LogFile {
 public:
  explicit LogFile(const std::filesystem::path& path) {
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0) return;
    queue_.emplace(file);
    close(file);
  }
  ~LogFile() { finish(Clock::now() + kLogTimeout); }
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;

  bool is_open() const { return queue_.has_value(); }
  // Returns false for the first line that the disk, full or too slow, does not take.
  bool add(const std::string& line) {
    if (!queue_ || (!queue_->closed() && queue_->offer(line + '\n'))) return true;
    return std::exchange(incomplete_, true);
  }
  // Returns false if the disk does not take the rest in time, and add() has not returned false.
  bool finish(Clock::time_point until) {
    if (!queue_ || queue_->finish(std::max(Clock::duration(0), until - Clock::now())) == 0)
      return true;
    return std::exchange(incomplete_, true);
  }

 private:
  bool incomplete_ = false;
  std::optional<base::OutputQueue> queue_;
};

Supervisor::~Supervisor() {
  for (Supervised& node : nodes_) node.child.reset();
  const auto until = Clock::now() + kLogTimeout;
  for (Supervised& node : nodes_)
    if (node.log && !node.log->finish(until)) report_incomplete_log(node);
}

void Supervisor::report_incomplete_log(const Supervised& node) const {
  output_.event(node.program.name +
                ": its log is incomplete: the disk is full or too slow, or the "
                "processor is overloaded");
}

Supervisor::Supervisor(const std::vector<Program>& programs, RestartSettings settings,
                       SupervisorOutput output, std::optional<WatchdogSettings> watchdog)
    : output_(std::move(output)), watchdog_(watchdog) {
  nodes_.reserve(programs.size());
  for (const Program& program : programs) {
    Supervised& node = nodes_.emplace_back();
    node.program = program;
    RestartSettings own = settings;
    own.is_dispensable = program.is_dispensable;
    if (own.is_dispensable) own.max_delay_s = std::max(own.max_delay_s, kDispensableDelay_s);
    node.policy = RestartPolicy(own);
    for (const int core : missing_cores(program.cores))
      output_.event(program.name + ": core " + std::to_string(core) +
                    " is not available on this machine; the node is not pinned to it");
    if (!program.log.empty()) {
      std::filesystem::create_directories(program.log.parent_path());
      node.log = std::make_unique<LogFile>(program.log);
      if (!node.log->is_open())
        output_.event(program.name + ": cannot write " + program.log.string());
    }
  }
  for (Supervised& node : nodes_) start(node);
}

void Supervisor::start(Supervised& node) {
  if (stopping()) return;
  node.start_due.reset();
  node.started = Clock::now();
  const std::int64_t stamp_ns = base::now_realtime_ns();
  try {
    node.heartbeat = watchdog_ ? std::make_unique<base::Heartbeat>() : nullptr;
    node.watchdog = Watchdog(watchdog_.value_or(WatchdogSettings{}));
    node.handles_frames = false;
    node.killed.reset();
    std::vector<std::string> argv = node.program.argv;
    if (node.program.arguments_at_start)
      std::ranges::copy(node.program.arguments_at_start(), std::back_inserter(argv));
    node.child = std::make_unique<ChildProcess>(argv, node.program.cores, node.heartbeat.get());
    node.processes.push_back({node.child->pid(), stamp_ns, {}});
  } catch (const std::system_error& error) {
    stop_deployment(node, StopDeployment{1, error.what()});
  }
}

void Supervisor::mark_healthy(const std::string& name, pid_t process) {
  for (Supervised& node : nodes_) {
    if (node.program.name != name ||
        std::ranges::count(node.processes, process, &ProcessRecord::pid) == 0)
      continue;
    node.policy.mark_healthy();
    if (process == node.processes.back().pid) node.handles_frames = true;
  }
}

void Supervisor::step(std::chrono::milliseconds wait) {
  poll_outputs(wait);
  for (Supervised& node : nodes_) {
    if (node.child) {
      // Queried before reading, so that the last output of an ended process is in the pipe.
      const auto exit = node.child->ended();
      forward_output(node, exit.has_value());
      if (exit) handle_exit(node, *exit);
    } else if (node.start_due && Clock::now() >= *node.start_due) {
      start(node);
    }
  }
  kill_stalled();
  kill_remaining();
}

void Supervisor::kill_stalled() {
  const auto now = Clock::now();
  const double elapsed_s =
      std::chrono::duration<double>(now - std::exchange(watched_, now)).count();
  if (stopping()) return;
  for (Supervised& node : nodes_) {
    if (!node.child || !node.heartbeat) continue;
    if (node.killed) {
      if (now < *node.killed + kKillTimeout) continue;
      abandon(node);
      restart(node, {true, SIGKILL});
      continue;
    }
    const std::string why = node.watchdog.step(node.heartbeat->process(), node.heartbeat->loop(),
                                               elapsed_s, node.handles_frames);
    if (why.empty()) continue;
    node.watchdog = Watchdog(*watchdog_);
    if (node.child->is_held()) continue;
    output_.event(node.program.name + " is stalled: " + why + "; it is killed");
    node.killed = now;
    node.child->signal_group(SIGKILL);
  }
}

void Supervisor::poll_outputs(std::chrono::milliseconds wait) const {
  std::vector<pollfd> fds;
  auto until = Clock::now() + wait;
  if (stop_deadline_) until = std::min(until, std::max(*stop_deadline_, Clock::now() + 10ms));
  for (const Supervised& node : nodes_) {
    if (node.child && node.child->output_fd() >= 0)
      fds.push_back({node.child->output_fd(), POLLIN, 0});
    // Without an open output, poll() does not return at the end of the process.
    if (node.child && node.child->output_fd() < 0) until = std::min(until, Clock::now() + 10ms);
    if (node.start_due) until = std::min(until, *node.start_due);
  }
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
  poll(fds.data(), nfds_t(fds.size()), int(std::max<std::int64_t>(0, left.count())));
}

void Supervisor::forward_output(Supervised& node, bool flush) {
  for (const std::string& line : node.child->read_lines(flush)) {
    output_.line(node.program.name, line);
    if (node.log && !node.log->add(line)) report_incomplete_log(node);
    node.last_lines.push_back(line);
    if (node.last_lines.size() > kFailureLogLines) node.last_lines.pop_front();
  }
}

void Supervisor::handle_exit(Supervised& node, const ProcessExit& exit) {
  node.processes.back().end = to_string(exit);
  node.child.reset();  // also kills the rest of its process group
  if (stopping()) {
    if (!is_expected_after_stop(exit) && !node.killed) {
      crashed_while_stopping_.push_back(node.program.name);
      output_.event(node.program.name + " died while stopping: " + to_string(exit));
    }
    return;
  }
  restart(node, exit);
}

void Supervisor::restart(Supervised& node, const ProcessExit& exit) {
  const double uptime_s = std::chrono::duration<double>(Clock::now() - node.started).count();
  const RestartDecision after = node.policy.on_exit(exit, uptime_s);
  if (const auto* restart = std::get_if<Restart>(&after)) {
    output_.event(node.program.name + " died: " + to_string(exit) + ", restart " +
                  std::to_string(restart->number) + " in " + seconds(restart->delay_s));
    node.start_due = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(restart->delay_s));
  } else if (const auto* why = std::get_if<StopDeployment>(&after)) {
    stop_deployment(node, *why);
  } else {
    node.exited_cleanly = true;
    output_.event(node.program.name + " exited cleanly");
  }
}

void Supervisor::stop_deployment(Supervised& node, const StopDeployment& why) {
  if (!failure_)
    failure_ = Failure{node.program.name,
                       why.reason,
                       {node.last_lines.begin(), node.last_lines.end()},
                       why.exit_code};
  output_.event(node.program.name + " " + why.reason + "; stopping the deployment");
  stop(kFailureGrace);
}

void Supervisor::stop(std::chrono::milliseconds grace) {
  const bool first = !stopping();
  const auto deadline = Clock::now() + grace;
  stop_deadline_ = first ? deadline : std::min(*stop_deadline_, deadline);
  if (!first) return;
  for (Supervised& node : nodes_) {
    node.start_due.reset();
    if (node.child) node.child->signal_group(SIGTERM);
  }
}

void Supervisor::kill_remaining() {
  if (!stop_deadline_ || Clock::now() < *stop_deadline_) return;
  for (Supervised& node : nodes_) {
    if (!node.child) continue;
    if (node.killed) {
      if (Clock::now() >= *node.killed + kKillTimeout) abandon(node);
      continue;
    }
    killed_.push_back(node.program.name);
    node.killed = Clock::now();
    output_.event(node.program.name + " did not end on SIGTERM in time and is killed");
    node.child->signal_group(SIGKILL);
  }
}

void Supervisor::abandon(Supervised& node) {
  const std::string outlives =
      "does not end on SIGKILL: it waits for a disk or a driver in the kernel, or the processor is "
      "overloaded";
  output_.event(node.program.name + " (process " + std::to_string(node.child->pid()) + ") " +
                outlives);
  node.processes.back().end = outlives;
  forward_output(node, true);
  node.child->abandon();
  node.child.reset();
}

bool Supervisor::all_exited() const {
  return std::none_of(nodes_.begin(), nodes_.end(),
                      [](const Supervised& node) { return node.child || node.start_due; });
}

bool Supervisor::exited_cleanly(const std::string& name) const {
  return std::any_of(nodes_.begin(), nodes_.end(), [&](const Supervised& node) {
    return node.program.name == name && node.exited_cleanly;
  });
}

std::vector<ProgramHistory> Supervisor::history() const {
  std::vector<ProgramHistory> history;
  for (const Supervised& node : nodes_)
    history.push_back({node.program.name,
                       std::filesystem::path(node.program.argv.front()).filename(),
                       node.processes});
  return history;
}

}  // namespace fivepipe::launch
