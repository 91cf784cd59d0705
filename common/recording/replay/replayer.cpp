#include "common/recording/replay/replayer.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/recording/files/frame_group_prefetcher.h"
#include "common/recording/replay/node_inputs.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;
using recording::FrameGroup;
using recording::KeyChange;
using recording::OwnedMessage;
using recording::RecordedChannel;

// Period of the calls of `control`.
constexpr auto kPollPeriod = 50ms;
// Maximum time until a message is due. A recording may hold any stamps, and a later time overflows.
constexpr double kMaxWait_s = 1e9;
// Within this time a waiting node wakes up and takes its received messages.
constexpr auto kNodeResetTime = 100ms;
// Within this time each node takes the session, also on a busy machine. It would drop the first
// frames if it took their maps before.
constexpr auto kSessionTime = 250ms;
// Maximum number of consecutive frames that no node waits for; less than a reader's queue holds.
constexpr int kMaxIncomplete = 4;
// Maximum wait for the frames in flight when the user ends a replay.
constexpr auto kLastFramesTimeout = 1s;

const bus::topics::Topic* topic_named(const std::string& name) {
  const auto found =
      std::find_if(bus::topics::all().begin(), bus::topics::all().end(),
                   [&](const bus::topics::Topic& topic) { return name == topic.name; });
  return found == bus::topics::all().end() ? nullptr : &*found;
}

int rank_of(const std::string& topic) {
  const bus::topics::Topic* found = topic_named(topic);
  return found ? int(found - bus::topics::all().data()) : int(bus::topics::all().size());
}

bool is_latched(const recording::RecordedChannel& channel) {
  const bus::topics::Topic* topic = topic_named(channel.topic);
  return topic && topic->delivery == bus::topics::Delivery::latched;
}

bus::SampleKind kind_of(std::optional<recording::KeyChange> change) {
  if (!change) return bus::SampleKind::data;
  return *change == recording::KeyChange::disposed ? bus::SampleKind::disposed
                                                   : bus::SampleKind::unregistered;
}

// Skips damaged chunks and counts them.
std::optional<recording::RecordedMessage> next_readable(recording::Recording::Cursor& cursor,
                                                        std::uint64_t& damaged) {
  for (;;) try {
      return cursor.next();
    } catch (const mcap::McapError& error) {
      spdlog::error("{}; skipping the damaged chunk", error.what());
      ++damaged;
    }
}

std::set<std::string> topics_of(const recording::Recording& recording, const ReplayPlan& plan) {
  std::set<std::string> topics;
  for (const mcap::Id id : plan.channels) topics.insert(recording.channel(id)->topic);
  return topics;
}

}  // namespace

Replayer::Replayer(bus::Bus& bus, const recording::Recording& recording, const ReplayPlan& plan)
    : bus_(bus),
      recording_(recording),
      plan_(plan),
      session_(bus.writer<bus::topics::ReplaySession>()),
      nodes_(bus, recording, plan, topics_of(recording, plan)) {
  std::string foreign;
  for (const std::string& problem : recording.type_differences(plan.channels))
    foreign += (foreign.empty() ? "" : "\n") + problem;
  if (!foreign.empty()) throw recording::RecordingError(foreign);
  for (const recording::RecordedChannel& channel : recording.channels()) {
    const bus::topics::Topic* topic = topic_named(channel.topic);
    if (!plan.channels.contains(channel.id) || !topic) continue;
    auto& writer = writers_[channel.topic + ' ' + channel.writer];
    if (!writer)
      writer = std::make_unique<bus::SerializedWriter>(
          bus, *topic, plan.lossless ? bus::WriterHistory::keep_all : bus::WriterHistory::topic);
    writer_of_[channel.id] = writer.get();
  }
}

std::vector<std::string> Replayer::conflicts() const {
  std::set<std::string> ours, found;
  for (const auto& [id, writer] : writer_of_) ours.insert(recording_.channel(id)->topic);
  for (const bus::EndpointDescription& endpoint : bus_.endpoints())
    if (endpoint.writes && !endpoint.own && ours.contains(endpoint.topic) &&
        endpoint.topic != bus::topics::NodeStatus::name &&
        // During a replay sim_node sends no spacing and ignores requests.
        endpoint.topic != bus::topics::ObjectSpacing::name &&
        endpoint.topic != bus::topics::SpacingRequest::name &&
        endpoint.topic != bus::topics::FrameTrace::name)
      found.insert("'" + endpoint.participant + "' writes " + endpoint.topic);
  return {found.begin(), found.end()};
}

std::string Replayer::missing_reader() const {
  std::map<std::string, std::set<std::string>> read_by;  // participant -> topics
  std::map<std::string, int> readers;                    // of other participants, by topic
  for (const bus::EndpointDescription& endpoint : bus_.endpoints())
    if (!endpoint.writes && !endpoint.own) {
      read_by[endpoint.participant].insert(endpoint.topic);
      ++readers[endpoint.topic];
    }
  for (const ReplayedNode& node : plan_.nodes)
    for (const std::string& topic : node.inputs)
      if (!read_by[node.name].contains(topic))
        return "node '" + node.name + "' does not read " + topic + " yet";
  // Discovery knows a reader before all writers have been matched with it.
  bool any = false;
  for (const auto& [id, writer] : writer_of_) {
    const std::string& topic = recording_.channel(id)->topic;
    if (writer->readers() < readers[topic]) return "a reader of " + topic + " is not matched yet";
    any |= readers[topic] > 0;
  }
  return any ? "" : "no node reads any of the topics";
}

recording::Recording::Cursor Replayer::cursor() const {
  return recording_.messages(plan_.start_ns, plan_.end_ns, plan_.channels);
}

void Replayer::announce() {
  fivepipe_v1_ReplaySession message{};
  messages::set_text(message.replay, "replay");
  message.lossless = plan_.lossless;
  message.rate = plan_.rate;
  session_.write(message);
  session_.wait_for_delivery(plan_.timeout);
  // Nodes discard their state when they take the session, which must precede the first frame.
  std::this_thread::sleep_for(kSessionTime);
}

void Replayer::run(const std::function<ReplayControl()>& control) {
  counts_ = {};
  stopped_ = stalled_ = false;
  pending_steps_ = consecutive_incomplete_ = 0;
  announce();
  nodes_.reset();
  counts_started_ = wall_zero_ = Clock::now();
  log_zero_ns_ = plan_.start_ns;
  send_latched_before_start();
  if (plan_.lossless && !plan_.nodes.empty())
    send_frames(control);
  else
    send_in_file_order(control);
  if (plan_.lossless && stopped_ && !stalled_) wait_for_in_flight();
  if (plan_.lossless && !stopped_) {
    wait_for_nodes(0, control);
    for (const auto& [name, writer] : writers_) writer->wait_for_delivery(plan_.timeout);
  }
  counts_.expected = nodes_.expected();
  counts_.handled = nodes_.handled();
  counts_.seconds = std::chrono::duration<double>(Clock::now() - counts_started_).count();
}

void Replayer::send_latched_before_start() {
  std::set<mcap::Id> latched;
  for (const auto& [id, writer] : writer_of_)
    if (is_latched(*recording_.channel(id))) latched.insert(id);
  if (latched.empty() || plan_.start_ns <= recording_.start_ns()) return;
  auto before = recording_.messages(0, plan_.start_ns - 1, latched);
  while (const auto message = before.next())
    if (!message->key_change)
      writer_of_.at(message->channel->id)
          ->write({bus::SampleKind::data, 0, message->source_stamp_ns, message->cdr});
}

// Returns false if the caller requests a stop.
bool Replayer::may_continue(const std::function<ReplayControl()>& control) {
  last_control_ = control();
  pending_steps_ += last_control_ == ReplayControl::step;
  stopped_ |= last_control_ == ReplayControl::stop;
  return !stopped_;
}

// `is_step`: a message that consumes one step of a paused replay; other messages follow the step
// without consuming another.
bool Replayer::wait_until(std::int64_t log_stamp_ns, bool is_step,
                          const std::function<ReplayControl()>& control) {
  const auto due = [&] {
    const double after_s = base::difference_s(log_stamp_ns, log_zero_ns_) / plan_.rate;
    return wall_zero_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                            std::clamp(after_s, -kMaxWait_s, kMaxWait_s)));
  };
  was_step_ = false;
  if (!may_continue(control)) return false;
  for (;;) {
    if (is_paused() && pending_steps_ > 0) {
      was_step_ = true;
      pending_steps_ -= is_step;
      if (plan_.rate > 0) wall_zero_ += Clock::now() - due();  // time continues from this message
      return true;
    }
    if (!is_paused() && (plan_.rate <= 0 || Clock::now() >= due())) return true;
    const auto before = Clock::now();
    const Clock::duration rest = is_paused() ? Clock::duration(kPollPeriod / 5) : due() - before;
    std::this_thread::sleep_for(std::min<Clock::duration>(rest, kPollPeriod));
    if (is_paused()) wall_zero_ += Clock::now() - before;
    if (!may_continue(control)) return false;
  }
}

void Replayer::write(const recording::RecordedChannel& channel,
                     std::optional<recording::KeyChange> change, std::int64_t source_stamp_ns,
                     std::span<const std::byte> cdr) {
  const auto writer = writer_of_.find(channel.id);
  if (writer == writer_of_.end()) return;
  const bus::SerializedSample sample{kind_of(change), 0, source_stamp_ns, cdr};
  bool sent = writer->second->write(sample);
  if (plan_.lossless)
    for (const auto until = Clock::now() + plan_.timeout; !sent && Clock::now() < until;)
      sent = writer->second->write(sample);
  if (change) return;
  ++counts_.in_file[channel.topic];
  counts_.sent[channel.topic] += sent;
}

void Replayer::send_in_file_order(const std::function<ReplayControl()>& control) {
  auto messages = cursor();
  recording::FrameIdReader frame_of(recording_);
  std::optional<std::uint64_t> newest;
  bool steps = false, step_has_frame = false;
  while (const auto message = next_readable(messages, counts_.damaged)) {
    const auto frame = frame_of(*message);
    const bool begins_frame = frame && (!newest || frame->frame > *newest);
    if (begins_frame) newest = frame->frame;
    // A step contains one frame, the messages before it, and those up to the next frame's
    // beginning.
    if (!steps || (begins_frame && step_has_frame)) {
      if (!wait_until(message->log_stamp_ns, true, control)) return;
      steps = was_step_;
      step_has_frame = false;
    }
    step_has_frame |= begins_frame;
    counts_.frames += begins_frame;
    write(*message->channel, message->key_change, message->source_stamp_ns, message->cdr);
  }
}

void Replayer::send_frames(const std::function<ReplayControl()>& control) {
  recording::FrameGroupPrefetcher ahead(recording::FrameGroups(recording_, cursor(), rank_of));
  ahead.wait_until_ready();
  counts_started_ = Clock::now();
  wall_zero_ = counts_started_;
  const bool sends_ahead = plan_.order == SendOrder::pipelined && plan_.rate <= 0;
  auto group = ahead.next();
  bool needed_is_sent = false;
  while (group) {
    if (!wait_until(group->log_stamp_ns, group->frame.has_value(), control)) return;
    if (group->frame && sends_ahead && !needed_is_sent) send_needed(*group);
    if (group->frame && !wait_for_nodes(std::size_t(plan_.frames_in_flight) - 1, control)) return;
    // A message of no frame takes effect between two frames, and between the same two in every run.
    if (!group->frame && !is_latched(*group->messages.front().channel) &&
        !wait_for_nodes(0, control))
      return;
    if (!group->frame || !sends_ahead) send_needed(*group);
    send_triggers(*group);
    pace_incomplete(*group);
    group = ahead.next();
    needed_is_sent = sends_ahead && group && group->frame;
    if (needed_is_sent) send_needed(*group);
  }
  counts_.late = ahead.late();
  counts_.damaged = ahead.damaged();
}

// No node publishes a FrameTrace for an incomplete frame. Waits after every kMaxIncomplete of them,
// so that incomplete frames do not push complete ones out of the nodes' reader queues.
void Replayer::pace_incomplete(const recording::FrameGroup& group) {
  consecutive_incomplete_ =
      !group.frame || nodes_.is_waited_for(*group.frame) ? 0 : consecutive_incomplete_ + 1;
  if (consecutive_incomplete_ < kMaxIncomplete) return;
  consecutive_incomplete_ = 0;
  for (const auto& [name, writer] : writers_) writer->wait_for_delivery(plan_.timeout);
  std::this_thread::sleep_for(kNodeResetTime);
}

void Replayer::send_needed(const recording::FrameGroup& group) {
  send_start_ns_ = base::now_realtime_ns();
  for (const recording::OwnedMessage& message : group.messages) {
    if (triggers_work(message.channel->topic)) continue;
    write(*message.channel, message.key_change, message.source_stamp_ns, message.cdr);
    if (const auto writer = writer_of_.find(message.channel->id); writer != writer_of_.end())
      not_acknowledged_.insert(writer->second);
  }
}

void Replayer::send_triggers(const recording::FrameGroup& group) {
  if (plan_.order != SendOrder::as_captured)
    for (bus::SerializedWriter* writer : not_acknowledged_)
      writer->wait_for_delivery(plan_.timeout);
  not_acknowledged_.clear();
  nodes_.expect(group);
  const std::int64_t release_ns = base::now_realtime_ns();
  for (const recording::OwnedMessage& message : group.messages)
    if (triggers_work(message.channel->topic))
      write(*message.channel, message.key_change, message.source_stamp_ns, message.cdr);
  if (!group.frame) return;
  ++counts_.frames;
  if (on_frame_sent)
    on_frame_sent(*group.frame, {send_start_ns_, release_ns, base::now_realtime_ns()});
}

void Replayer::wait_for_in_flight() {
  for (const auto until = Clock::now() + kLastFramesTimeout;
       Clock::now() < until && nodes_.max_open_frames() > 0; nodes_.take_traces())
    bus_.wait(kPollPeriod);
}

// Waits until each node has at most `max_in_flight` frames. Returns false if a node stalls or the
// caller requests a stop.
bool Replayer::wait_for_nodes(std::size_t max_in_flight,
                              const std::function<ReplayControl()>& control) {
  for (;;) {
    nodes_.take_traces();
    if (nodes_.max_open_frames() <= max_in_flight) return true;
    if (const std::string stalled = nodes_.stalled(max_in_flight); !stalled.empty()) {
      spdlog::error(stalled);
      stopped_ = stalled_ = true;
      return false;
    }
    bus_.wait(kPollPeriod);
    if (!may_continue(control)) return false;
  }
}

}  // namespace fivepipe::replay
