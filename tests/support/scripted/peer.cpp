#include "tests/support/scripted/peer.h"

#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/base/timing.h"
#include "common/config/deployment.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/recording/replay/node_inputs.h"
#include "tests/support/process/cpu_time.h"

namespace fivepipe::test {
namespace {

using messages::span_of;

NodeReport report_of(const fivepipe_v1_NodeStatus& status) {
  NodeReport report;
  report.has_handled_frame = status.has_handled_frame;
  report.is_final = status.final_report;
  report.frame = status.frame;
  report.gl_renderer = status.gl_renderer;
  for (const auto& count : span_of(status.counts)) report.counts[count.name] = count.count;
  for (const auto& drop : span_of(status.drops))
    report.drops[messages::text_of({drop.reason, drop.subject, drop.detail})] = drop.count;
  for (const auto& topic : span_of(status.topics)) report.sent[topic.topic] = topic.sent;
  for (const auto& empty : span_of(status.empty_cameras))
    report.empty_cameras[empty.camera] = empty.frames;
  for (const auto& collision : span_of(status.collisions))
    report.collisions[collision.object] = {collision.frames, collision.points,
                                           collision.first_contacts};
  for (const auto& latency : span_of(status.latencies))
    report.latencies[latency.name] = {latency.p50_ms, latency.max_ms, latency.count};
  for (const auto& diagnostic : span_of(status.diagnostics))
    report.diagnostics[diagnostic.subject] = diagnostic.text;
  return report;
}

TracedFrame traced(const bus::Sample<bus::topics::FrameTrace>& sample) {
  TracedFrame trace{sample->node,           sample->frame,         sample->capture_stamp_ns,
                    sample->first_input_ns, sample->last_input_ns, {}};
  for (const auto& step : span_of(sample->steps))
    trace.steps.push_back({step.step, step.start_ns, step.end_ns});
  return trace;
}

}  // namespace

ScriptedPeer::ScriptedPeer()
    : RecordingTest(true, kScriptedDeployment), out_(folder_ / "out"), traces_(bus_, traced) {}

std::string ScriptedPeer::file(const std::string& name, const std::string& text) const {
  std::ofstream(folder_ / name) << text;
  return folder_ / name;
}

void ScriptedPeer::start(const std::string& program, const std::string& name,
                         const std::string& deployment, const std::vector<std::string>& more) {
  name_ = name;
  report_ = {};
  statuses_.emplace(bus_.reader<bus::topics::NodeStatus>());
  program_ = node(program, name, deployment, more);
  const config::Deployment loaded = config::load_deployment(deployment);
  const config::Node& under_test = *config::find_node(loaded, name);
  EXPECT_TRUE(eventually(bus_, kStart, [&] {
    return (takes_part(name, false, replay::inputs_of(loaded, under_test)) &&
            takes_part(name, true, replay::outputs_of(loaded, under_test)) &&
            traces_.writers() > 0) ||
           has_failed();
  })) << said();
  // Discovery announces readers in the order of their creation, so a node whose status arrives has
  // found all of them.
  EXPECT_TRUE(reports_again()) << said();
}

bool ScriptedPeer::holds(const std::function<bool()>& condition) {
  bool is_met = false;
  eventually(bus_, kAnswer, [&] {
    report();
    traces_.take();
    is_met = condition();
    return is_met || has_failed();
  });
  return is_met;
}

bool ScriptedPeer::has_failed() {
  return program_->wait_for_end(std::chrono::milliseconds(0)).value_or(0) != 0;
}

void ScriptedPeer::at_once(const std::function<void()>& send) {
  const pid_t main_thread = program_->pid();
  ASSERT_EQ(ptrace(PTRACE_SEIZE, main_thread, nullptr, nullptr), 0) << std::strerror(errno);
  ASSERT_EQ(ptrace(PTRACE_INTERRUPT, main_thread, nullptr, nullptr), 0) << std::strerror(errno);
  int status = 0;
  ASSERT_EQ(waitpid(main_thread, &status, __WALL), main_thread) << std::strerror(errno);
  ASSERT_TRUE(WIFSTOPPED(status));
  is_stopped_ = true;
  send();
  is_stopped_ = false;
  ASSERT_EQ(ptrace(PTRACE_DETACH, main_thread, nullptr, nullptr), 0) << std::strerror(errno);
}

void ScriptedPeer::begin_replay(bool lossless) {
  if (!sessions_) sessions_.emplace(bus_.writer<bus::topics::ReplaySession>());
  wait_for_readers(*sessions_);
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, "script");
  session.lossless = lossless;
  deliver(*sessions_, session);
  // The node discards its state when it takes the session, which it polls for ten times a second.
  EXPECT_TRUE(is_stopped_ || reports_again()) << said();
}

void ScriptedPeer::end_replay() { sessions_.reset(); }

const NodeReport& ScriptedPeer::report() {
  for (const auto& sample : statuses_->take())
    if (sample.valid() && name_ == sample->node) {
      report_ = report_of(*sample);
      ++reports_;
    }
  return report_;
}

bool ScriptedPeer::reports_again(int count) {
  const std::uint64_t before = reports_;
  return holds([&] { return reports_ >= before + std::uint64_t(count); });
}

void ScriptedPeer::expect_sleep() {
  ASSERT_TRUE(reports_again()) << said();
  const auto start = std::chrono::steady_clock::now();
  const double before_s = cpu_s(program_->pid());
  ASSERT_TRUE(reports_again()) << said();
  EXPECT_LT(cpu_s(program_->pid()) - before_s, kMaxWaitingShare * base::seconds_since(start));
}

NodeReport ScriptedPeer::ended() {
  program_->signal(SIGTERM);
  EXPECT_TRUE(holds([&] { return report().is_final; })) << said();
  EXPECT_EQ(program_->wait_for_end(kAnswer), 0) << said();
  return report_;
}

std::uint64_t drops_of(const NodeReport& report, const std::string& reason) {
  std::uint64_t sum = 0;
  for (const auto& [text, count] : report.drops)
    if (text == reason || text.starts_with(reason + ":")) sum += count;
  return sum;
}

}  // namespace fivepipe::test
