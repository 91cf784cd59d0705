#include "common/recording/replay/in_flight_tracker.h"

#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <utility>

#include "common/base/realtime.h"
#include "common/base/text_table.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/recording/replay/progress.h"

namespace fivepipe::replay {
namespace {

using recording::FrameGroup;
using recording::OwnedMessage;

std::size_t messages_of(const recording::FrameGroup& group, const char* topic) {
  return std::size_t(std::count_if(group.messages.begin(), group.messages.end(),
                                   [&](const recording::OwnedMessage& m) {
                                     return m.channel->topic == topic && !m.key_change;
                                   }));
}

// Maps of one frame number that a node sent before and after a restart form no frame set
// (frames::FrameSetAssembler).
bool is_of_one_run(const recording::FrameGroup& group) {
  std::map<std::string, std::string> writer_of_node;
  return std::all_of(
      group.messages.begin(), group.messages.end(), [&](const recording::OwnedMessage& message) {
        const recording::RecordedChannel& channel = *message.channel;
        return channel.topic != bus::topics::ObjectPixelMap::name || message.key_change ||
               writer_of_node.try_emplace(channel.node, channel.writer).first->second ==
                   channel.writer;
      });
}

// Benchmarks subtract the stamps of a trace.
bool has_plausible_stamps(const fivepipe_v1_FrameTrace& trace) {
  const auto plausible = [&](std::int64_t stamp_ns) {
    return !messages::why_implausible(trace.frame, stamp_ns);
  };
  const auto steps = messages::span_of(trace.steps);
  return plausible(trace.first_input_ns) && plausible(trace.last_input_ns) &&
         std::all_of(steps.begin(), steps.end(), [&](const fivepipe_v1_FrameStep& step) {
           return plausible(step.start_ns) && plausible(step.end_ns);
         });
}

}  // namespace

InFlightTracker::InFlightTracker(bus::Bus& bus, const recording::Recording& recording,
                                 const ReplayPlan& plan, std::set<std::string> replayed)
    : recording_(recording), plan_(plan), replayed_(std::move(replayed)) {
  if (plan.lossless && !plan.nodes.empty()) traces_.emplace(bus.reader<bus::topics::FrameTrace>());
}

void InFlightTracker::reset() {
  progress_.clear();
  for (const ReplayedNode& node : plan_.nodes) {
    expected_[node.name] = handled_[node.name] = 0;
    progress_[node.name];
  }
  if (traces_) traces_->take();
}

bool InFlightTracker::has_all_tiles(const recording::FrameGroup& group,
                                    const std::set<std::string>& names) {
  std::optional<schema::FieldReader> view_of, tiles_of;
  TilesByView views;
  for (const recording::OwnedMessage& message : group.messages) {
    if (message.channel->topic != bus::topics::HullTile::name || message.key_change) continue;
    if (!view_of) {
      const schema::Idl& idl = recording_.idl(*message.channel);
      view_of.emplace(idl, message.channel->type, "viewer");
      tiles_of.emplace(idl, message.channel->type, "tiles");
    }
    const auto view = view_of->read(message.cdr), all = tiles_of->read(message.cdr);
    if (!view || !all || !std::get_if<std::string>(&*view) || !std::get_if<std::uint64_t>(&*all))
      return false;
    Tiles& tiles = views[std::get<std::string>(*view)];
    ++tiles.present;
    tiles.all = std::get<std::uint64_t>(*all);
  }
  warn_of_other_views(views, names);
  return std::all_of(names.begin(), names.end(), [&](const auto& name) {
    const auto view = views.find(name);
    return view != views.end() && view->second.present == view->second.all;
  });
}

// If the recording lacks a view of the node and has another one, logs the views of both, once: the
// frames of a recording with another number of eyes are never complete. Views of spectators do not
// matter.
void InFlightTracker::warn_of_other_views(const TilesByView& views,
                                          const std::set<std::string>& names) {
  const bool is_known = std::ranges::all_of(
                 views, [&](const auto&view) { return names.contains(view.first); }),
             is_whole = std::ranges::all_of(
                 names, [&](const std::string&name) { return views.contains(name); });
  if (is_known || is_whole || std::exchange(is_warned_of_views_, true)) return;
  std::set<std::string> recorded;
  for (const auto& [name, tiles] : views) recorded.insert(base::printable(name));
  spdlog::warn("the recording has tiles of the views {}, the deployment has the views {}",
               fmt::join(recorded, ", "), fmt::join(names, ", "));
}

bool InFlightTracker::is_complete_for(const ReplayedNode& node,
                                      const recording::FrameGroup& group) {
  // If tiles are not replayed, reconstruction nodes make them, for the frames that are complete for
  // those nodes.
  if (node.program == "render_node" && replayed_.contains(bus::topics::HullTile::name))
    return has_all_tiles(group, node.hull_views);
  const bool has_set =
      plan_.shape_cameras > 0 &&
      messages_of(group, bus::topics::ObjectPixelMap::name) == plan_.shape_cameras &&
      is_of_one_run(group);
  return has_set &&
         (node.program == "sim_node" || messages_of(group, bus::topics::HeadPose::name) > 0);
}

void InFlightTracker::expect(const recording::FrameGroup& group) {
  if (!group.frame) return;
  for (const ReplayedNode& node : plan_.nodes) {
    if (!is_complete_for(node, group)) continue;
    ++expected_[node.name];
    Progress& progress = progress_[node.name];
    if (progress.open.empty()) progress.last_trace = Clock::now();
    progress.open.insert(*group.frame);
  }
}

void InFlightTracker::take_traces() {
  if (!traces_) return;
  for (const auto& sample : traces_->take()) {
    if (!sample.valid()) continue;
    if (!has_plausible_stamps(*sample)) {
      refuse(sample);
      continue;
    }
    const auto progress = progress_.find(sample->node);
    if (progress == progress_.end()) continue;
    if (progress->second.open.erase(sample->frame)) ++handled_[sample->node];
    progress->second.last_trace = Clock::now();
    if (on_trace) on_trace(*sample);
  }
}

void InFlightTracker::refuse(const bus::Sample<bus::topics::FrameTrace>& trace) {
  ++refused_;
  const auto now = Clock::now();
  if (refusal_logged_ && now - *refusal_logged_ < kProgressPeriod) return;
  refusal_logged_ = now;
  spdlog::warn("dropped: bad_trace: {}: frame number or timestamp impossible; from {} ({} so far)",
               base::printable(trace->node), base::printable(bus::text_of(traces_->process(trace))),
               refused_);
}

bool InFlightTracker::is_waited_for(std::uint64_t frame) const {
  return std::any_of(progress_.begin(), progress_.end(),
                     [&](const auto& node) { return node.second.open.contains(frame); });
}

std::size_t InFlightTracker::max_open_frames() const {
  std::size_t max_open = 0;
  for (const auto& [name, progress] : progress_)
    max_open = std::max(max_open, progress.open.size());
  return max_open;
}

std::string InFlightTracker::stalled(std::size_t max_in_flight) const {
  for (const auto& [name, progress] : progress_)
    if (progress.open.size() > max_in_flight && Clock::now() - progress.last_trace > plan_.timeout)
      return "node '" + name + "' has not handled frame " + std::to_string(*progress.open.begin()) +
             " in " + std::to_string(plan_.timeout.count() / 1000) + " s";
  return "";
}

}  // namespace fivepipe::replay
