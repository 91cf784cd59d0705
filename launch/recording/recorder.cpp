#include "launch/recording/recorder.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "common/clock/realtime.h"
#include "common/recording/format.h"
#include "common/schema/wire_types.h"
#include "common/version/version.h"
#include "launch/machine.h"

namespace fivepipe {
namespace {

namespace fs = std::filesystem;

// What a node's counts of sent messages begin with (common/node/status.cpp).
constexpr std::string_view kSentPrefix = "sent: ";

// The deepest folder that holds all of them.
fs::path common_folder(const std::vector<fs::path>& files) {
  fs::path common = fs::absolute(files.front()).lexically_normal().parent_path();
  for (const fs::path& file : files) {
    const fs::path absolute = fs::absolute(file).lexically_normal();
    while (std::mismatch(common.begin(), common.end(), absolute.begin(), absolute.end()).first != common.end()) common = common.parent_path();
  }
  return common;
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw std::runtime_error(path.string() + " can't be read");
  return text.str();
}

const char* delivery_name(topics::Delivery delivery) {
  switch (delivery) {
    case topics::Delivery::stream: return "stream";
    case topics::Delivery::latched: return "latched";
    case topics::Delivery::event: break;
  }
  return "event";
}

}  // namespace

void write_header(recording::RecordingWriter& recording, const Deployment* deployment, const std::map<std::string, std::string>& settings, std::uint32_t domain) {
  const std::uint64_t now_ns = std::uint64_t(now_realtime_ns());
  mcap::Metadata header{recording::kRecordingMetadata,
                        {{"version", version()}, {"commit", commit()}, {"build_type", build_type()}, {"host", host_name()}, {"cpu", cpu_name()},
                         {"cores", std::to_string(core_count())}, {"domain", std::to_string(domain)}}};
  if (deployment) {
    const fs::path folder = common_folder(deployment->files);
    for (const fs::path& file : deployment->files) {
      const std::string name = fs::absolute(file).lexically_normal().lexically_relative(folder).string();
      recording.attach({now_ns, now_ns, recording::kDeploymentFolder + name, file.extension() == ".yaml" ? "application/yaml" : "application/octet-stream", text_of(file)});
    }
    header.values[recording::kDeploymentFileKey] = fs::absolute(deployment->file).lexically_normal().lexically_relative(folder).string();
    header.values["deployment"] = deployment->name;
    recording.add({recording::kSettingsMetadata, settings});
  }
  recording.add(header);
}

Recorder::Recorder(Bus& bus, recording::RecordingWriter& recording, const std::vector<topics::Topic>& topics)
    : bus_(bus), recording_(recording), statuses_(bus.reader<topics::NodeStatus>()) {
  for (const topics::Topic& topic : topics) sources_.push_back(std::make_unique<Source>(Source{SerializedReader(bus, topic), topic, {}, {}}));
}

std::optional<mcap::Id> Recorder::channel(Source& source, std::uint64_t writer) {
  const auto known = source.channel_of_writer.find(writer);
  if (known != source.channel_of_writer.end()) return known->second;
  std::map<std::string, std::string> metadata{{"delivery", delivery_name(source.topic.delivery)}};
  std::string node;
  if (const auto described = source.reader.writer(writer)) {
    for (const EndpointDescription& endpoint : bus_.endpoints())
      if (endpoint.guid == described->guid) {
        if (endpoint.own) return source.channel_of_writer[writer] = std::nullopt;
        node = endpoint.participant;
      }
    metadata["writer"] = described->guid;
    metadata["participant"] = described->participant_guid;
    for (const auto& [policy, value] : described->qos) metadata["qos." + policy] = value;
  }
  metadata["node"] = node;
  const mcap::Id id = recording_.add_channel(source.topic.name, source.topic.type, schema::fivepipe_schema(source.topic.type), metadata);
  source.node_of_channel[id] = node;
  return source.channel_of_writer[writer] = id;
}

void Recorder::take() {
  for (const auto& source : sources_)
    source->reader.take([&](const SerializedSample& sample) {
      const auto id = channel(*source, sample.writer);
      if (!id) return;
      const std::int64_t now_ns = now_realtime_ns();
      if (sample.kind == SampleKind::data) {
        recording_.add(*id, now_ns, sample.source_stamp_ns, sample.cdr);
        ++received_[source->node_of_channel.at(*id)][source->topic.name];
      } else {
        const auto change = sample.kind == SampleKind::disposed ? recording::KeyChange::disposed : recording::KeyChange::unregistered;
        recording_.add(*id, now_ns, sample.source_stamp_ns, change, sample.cdr);
      }
    });
  take_statuses();
  recording_.tick(now_realtime_ns());
}

bool Recorder::writes_statuses(const std::string& node) const {
  const auto endpoints = bus_.endpoints();
  return std::any_of(endpoints.begin(), endpoints.end(),
                     [&](const EndpointDescription& e) { return e.writes && e.participant == node && e.topic == topics::NodeStatus::name; });
}

void Recorder::take_statuses() {
  for (const auto& sample : statuses_.take()) {
    if (!sample.valid()) continue;
    std::map<std::string, std::uint64_t> sent;
    for (std::uint32_t i = 0; i < sample->counts._length; ++i) {
      const fivepipe_v1_NamedCount& count = sample->counts._buffer[i];
      if (std::string_view(count.name).starts_with(kSentPrefix)) sent[std::string(count.name).substr(kSentPrefix.size())] = count.count;
    }
    // The status itself is always one behind.
    sent.erase(topics::NodeStatus::name);
    const auto [process, is_new] = processes_.try_emplace(sample.writer(), sample->node, SentBy{});
    // A replay sends the statuses of others.
    if (is_new)
      process->second.second.from_the_start =
          writes_statuses(sample->node) && std::all_of(sent.begin(), sent.end(), [](const auto& topic) { return topic.second == 0; });
    process->second.second.sent = sent;
  }
}

std::vector<Shortfall> Recorder::shortfalls() const {
  std::map<std::string, SentBy> of_node;  // all its processes
  for (const auto& [writer, process] : processes_) {
    const auto [node, is_new] = of_node.try_emplace(process.first, SentBy{true, {}});
    node->second.from_the_start &= process.second.from_the_start;
    for (const auto& [topic, count] : process.second.sent) node->second.sent[topic] += count;
  }
  std::vector<Shortfall> all;
  for (const auto& [node, by] : of_node) {
    if (!by.from_the_start) continue;
    for (const auto& source : sources_) {
      const auto sent = by.sent.find(source->topic.name);
      if (sent == by.sent.end()) continue;
      std::uint64_t received = 0;
      if (const auto topics = received_.find(node); topics != received_.end())
        if (const auto count = topics->second.find(source->topic.name); count != topics->second.end()) received = count->second;
      if (sent->second > received) all.push_back({node, source->topic.name, sent->second, received});
    }
  }
  return all;
}

}  // namespace fivepipe
