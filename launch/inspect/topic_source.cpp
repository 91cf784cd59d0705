#include "launch/inspect/topic_source.h"

#include <algorithm>
#include <iostream>
#include <set>

#include "common/base/realtime.h"

namespace fivepipe::launch {

recording::Recording opened(const std::filesystem::path& file) {
  recording::Recording recording(file);
  if (!recording.mcap().is_finished())
    std::cerr << file.string()
              << " is not finished; reading its complete chunks (see `fivepipe info`)\n";
  return recording;
}

std::vector<std::string> topics_in(const recording::Recording& recording) {
  std::set<std::string> names;
  for (const recording::RecordedChannel& channel : recording.channels())
    names.insert(channel.topic);
  return {names.begin(), names.end()};
}

const recording::RecordedChannel& data_channel(const recording::Recording& recording,
                                               const recording::RecordedChannel& channel) {
  if (!channel.key_states) return channel;
  for (const recording::RecordedChannel& other : recording.channels())
    if (!other.key_states && other.topic == channel.topic) return other;
  throw recording::RecordingError(recording.file().string() + ": " + channel.topic +
                                  " has key changes, but no type");
}

int each_message(const recording::Recording& recording, const std::string& topic, double start_s,
                 std::optional<double> end_s,
                 const std::function<bool(const recording::RecordedMessage&)>& each) {
  std::set<mcap::Id> channels;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (channel.topic == topic) channels.insert(channel.id);
  const std::int64_t end_ns =
      end_s ? base::later_by_s(recording.start_ns(), *end_s) : recording.end_ns();
  auto cursor =
      recording.messages(base::later_by_s(recording.start_ns(), start_s), end_ns, channels);
  int result = 0;
  for (;;) try {
      const auto message = cursor.next();
      if (!message || !each(*message)) return result;
    } catch (const mcap::McapError& error) {
      std::cerr << error.what() << "; skipping the damaged chunk\n";
      result = 1;
    }
}

bus::topics::Topic live_topic(const std::string& text) {
  std::vector<std::string> names;
  for (const bus::topics::Topic& topic : bus::topics::all()) names.push_back(topic.name);
  const std::string name = resolve_topic(text, names);
  return *std::find_if(bus::topics::all().begin(), bus::topics::all().end(),
                       [&](const bus::topics::Topic& topic) { return name == topic.name; });
}

std::optional<recording::KeyChange> key_change_of(bus::SampleKind kind) {
  if (kind == bus::SampleKind::data) return std::nullopt;
  return kind == bus::SampleKind::disposed ? recording::KeyChange::disposed
                                           : recording::KeyChange::unregistered;
}

const std::string& WriterNames::of(std::uint64_t writer) {
  if (const std::string* known = known_.find(writer)) return *known;
  const auto described = reader_.writer(writer);
  if (!described) return known_.set(writer, "(gone)");
  std::string name;
  for (const bus::EndpointDescription& endpoint : bus_.endpoints())
    if (endpoint.guid == described->guid) name = endpoint.participant;
  if (name.empty()) name = "(" + described->participant_guid.substr(0, 8) + ")";
  return known_.set(writer, name);
}

}  // namespace fivepipe::launch
