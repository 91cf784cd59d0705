#include "launch/inspect/recording_info.h"

#include <algorithm>
#include <charconv>

#include "common/recording/files/format.h"

namespace fivepipe::launch {
namespace {

using recording::RecordedChannel;
using recording::Recording;

std::string writer_name(const recording::RecordedChannel& channel) {
  return !channel.node.empty() ? channel.node : !channel.writer.empty() ? channel.writer : "?";
}

std::map<std::string, TopicInfo> topics_of(const recording::Recording& recording,
                                           double duration_s) {
  std::map<std::string, TopicInfo> topics;
  for (const recording::RecordedChannel& channel : recording.channels()) {
    TopicInfo& topic = topics[channel.topic];
    topic.topic = channel.topic;
    if (!channel.key_states) topic.type = channel.type;
    (channel.key_states ? topic.key_changes : topic.messages) += channel.messages;
    topic.writers.insert(writer_name(channel));
  }
  for (auto& [name, topic] : topics)
    if (duration_s > 0) topic.rate_hz = double(topic.messages) / duration_s;
  return topics;
}

// Sequence numbers of one writer. A writer that does not count sends a constant.
struct SequenceSpan {
  std::uint32_t first_sequence = 0, last_sequence = 0;
  std::uint64_t count = 0;
  void add(std::uint32_t sequence) {
    first_sequence = count == 0 ? sequence : std::min(first_sequence, sequence);
    last_sequence = count == 0 ? sequence : std::max(last_sequence, sequence);
    ++count;
  }
  std::uint64_t missing() const {
    const std::uint64_t span = std::uint64_t(last_sequence) - first_sequence + 1;
    return span > count ? span - count : 0;
  }
};

void read_all(const recording::Recording& recording, std::map<std::string, TopicInfo>& topics,
              std::vector<std::string>& unreadable) {
  std::map<mcap::Id, SequenceSpan> spans;
  auto cursor = recording.messages();
  for (bool more = true; more;) try {
      const auto message = cursor.next();
      more = message.has_value();
      if (!more) break;
      topics.at(message->channel->topic).bytes += message->cdr.size();
      spans[message->channel->id].add(message->sequence);
    } catch (const mcap::McapError& error) {
      unreadable.push_back(error.what());
    }
  for (const auto& [id, span] : spans)
    topics.at(recording.channel(id)->topic).missing += span.missing();
}

std::map<std::string, std::string> metadata_of(const recording::Recording& recording,
                                               const char* name,
                                               std::vector<std::string>& unreadable) {
  try {
    return recording.metadata(name);
  } catch (const mcap::McapError& error) {
    unreadable.push_back(error.what());
    return {};
  }
}

// Parses the keys "TOPIC received", "TOPIC written" and so on.
std::map<std::string, RecorderCounts> counts_from(
    const std::map<std::string, std::string>& values) {
  static const std::pair<std::string, std::uint64_t RecorderCounts::*> kinds[] = {
      {" received", &RecorderCounts::received},
      {" written", &RecorderCounts::written},
      {" lost", &RecorderCounts::lost},
      {" sent", &RecorderCounts::sent},
      {" missing", &RecorderCounts::missing}};
  std::map<std::string, RecorderCounts> counts;
  for (const auto& [key, value] : values)
    for (const auto& [suffix, count] : kinds)
      if (key.ends_with(suffix))
        std::from_chars(value.data(), value.data() + value.size(),
                        counts[key.substr(0, key.size() - suffix.size())].*count);
  return counts;
}

// Reads the final counts, or the newest ones of a recording that was cut off.
void read_counts(const recording::Recording& recording, RecordingInfo& info) {
  const std::size_t unreadable_before = info.unreadable.size();
  auto counts = metadata_of(recording, recording::kCountsMetadata, info.unreadable);
  info.final_counts_damaged = info.unreadable.size() > unreadable_before;
  if (counts.empty()) {
    counts = metadata_of(recording, recording::kCountsSoFarMetadata, info.unreadable);
    if (counts.empty()) return;
    const std::string& stamp = counts[recording::kCountsStampKey];
    std::from_chars(stamp.data(), stamp.data() + stamp.size(), info.counts_stamp_ns.emplace(0));
  }
  info.counts = counts_from(counts);
  if (const auto why = counts.find(recording::kLossReasonKey); why != counts.end())
    info.loss_reason = why->second;
}

std::vector<std::string> type_differences_of(const recording::Recording& recording) {
  std::set<std::string> problems;
  const std::string file = recording.file().string() + ": ";
  for (const recording::RecordedChannel& channel : recording.channels()) {
    std::vector<std::string> found;
    try {
      found = recording.type_differences({channel.id});
    } catch (const recording::RecordingError& error) {
      found = {error.what()};
    }
    for (const std::string& problem : found)
      problems.insert(problem.starts_with(file) ? problem.substr(file.size()) : problem);
  }
  return {problems.begin(), problems.end()};
}

}  // namespace

RecordingInfo inspect(const recording::Recording& recording, bool reads_all) {
  const mcap::Reader& reader = recording.mcap();
  RecordingInfo info;
  info.file = recording.file().string();
  info.file_bytes = std::filesystem::file_size(recording.file());
  info.damage = reader.damage();
  info.read_all = reads_all;
  info.start_ns = recording.start_ns();
  info.end_ns = recording.end_ns();
  info.messages = reader.statistics().messages;
  for (const mcap::ChunkIndex& chunk : reader.chunks()) {
    ++info.chunks[chunk.compression];
    info.compressed_bytes += chunk.compressed_bytes;
    info.uncompressed_bytes += chunk.uncompressed_bytes;
  }
  info.attachments = reader.attachments();
  info.header = metadata_of(recording, recording::kRecordingMetadata, info.unreadable);
  info.settings = metadata_of(recording, recording::kSettingsMetadata, info.unreadable);
  read_counts(recording, info);
  info.type_differences = type_differences_of(recording);
  auto topics = topics_of(recording, info.duration_s());
  if (reads_all) read_all(recording, topics, info.unreadable);
  for (auto& [name, topic] : topics) info.topics.push_back(std::move(topic));
  return info;
}

}  // namespace fivepipe::launch
