#include "common/recording/replay/recorder.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "common/base/machine.h"
#include "common/base/realtime.h"
#include "common/base/version.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/recording/files/format.h"
#include "common/recording/schema/wire_types.h"

namespace fivepipe::replay {
namespace {

namespace fs = std::filesystem;

// Reading discovery takes up to a millisecond.
constexpr std::chrono::milliseconds kDiscoveryPeriod{500};

// The deepest folder that contains all files.
fs::path common_folder(const std::vector<fs::path>& files) {
  fs::path common = fs::absolute(files.front()).lexically_normal().parent_path();
  for (const fs::path& file : files) {
    const fs::path absolute = fs::absolute(file).lexically_normal();
    while (std::mismatch(common.begin(), common.end(), absolute.begin(), absolute.end()).first !=
           common.end())
      common = common.parent_path();
  }
  return common;
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw std::runtime_error(path.string() + " cannot be read");
  return text.str();
}

const char* delivery_name(bus::topics::Delivery delivery) {
  switch (delivery) {
    case bus::topics::Delivery::stream: return "stream";
    case bus::topics::Delivery::latched: return "latched";
    case bus::topics::Delivery::event: break;
  }
  return "event";
}

}  // namespace

std::string refusal_to_overwrite(const fs::path& file) {
  return fs::exists(file) ? file.string() + " exists; use --force to overwrite it" : "";
}

void write_header(recording::RecordingWriter& recording, const config::Deployment* deployment,
                  const std::map<std::string, std::string>& settings, std::uint32_t domain) {
  const std::uint64_t now_ns = std::uint64_t(base::now_realtime_ns());
  mcap::Metadata header{recording::kRecordingMetadata,
                        {{"version", base::version()},
                         {"commit", base::commit()},
                         {"build_type", base::build_type()},
                         {"host", base::host_name()},
                         {"cpu", base::cpu_name()},
                         {"cores", std::to_string(base::core_count())},
                         {"domain", std::to_string(domain)}}};
  if (deployment) {
    const fs::path folder = common_folder(deployment->files);
    for (const fs::path& file : deployment->files) {
      const std::string name =
          fs::absolute(file).lexically_normal().lexically_relative(folder).string();
      recording.attach(
          {now_ns, now_ns, recording::kDeploymentFolder + name,
           file.extension() == ".yaml" ? "application/yaml" : "application/octet-stream",
           text_of(file)});
    }
    header.values[recording::kDeploymentFileKey] =
        fs::absolute(deployment->file).lexically_normal().lexically_relative(folder).string();
    header.values["deployment"] = deployment->name;
    recording.add({recording::kSettingsMetadata, settings});
  }
  recording.add(header);
}

Recorder::Recorder(bus::Bus& bus, recording::RecordingWriter& recording,
                   const std::vector<bus::topics::Topic>& topics)
    : bus_(bus),
      recording_(recording),
      statuses_(bus.reader<bus::topics::NodeStatus>()),
      loss_detector_(base::now_realtime_ns()) {
  for (const bus::topics::Topic& topic : topics)
    sources_.push_back(
        std::make_unique<Source>(Source{bus::SerializedReader(bus, topic), topic, {}, {}}));
}

bool Recorder::is_own(const bus::WriterDescription& writer) const {
  const auto endpoints = bus_.endpoints();
  return std::any_of(endpoints.begin(), endpoints.end(),
                     [&](const bus::EndpointDescription& endpoint) {
                       return endpoint.own && endpoint.guid == writer.guid;
                     });
}

std::string Recorder::node_of(const bus::WriterDescription& writer) {
  for (const bus::EndpointDescription& endpoint : bus_.endpoints())
    if (endpoint.participant_guid == writer.participant_guid && !endpoint.participant.empty())
      return node_of_participant_[writer.participant_guid] = endpoint.participant;
  return node_of_participant_[writer.participant_guid];
}

void Recorder::drop_without_channel(const std::string& topic, std::size_t bytes) {
  if (full_reason_.empty()) {
    const auto most =
        std::max_element(channels_of_participant_.begin(), channels_of_participant_.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    full_reason_ = recording::kFullReason;
    if (most != channels_of_participant_.end())
      full_reason_ += ", of which '" + most->first + "' uses " + std::to_string(most->second);
    spdlog::error("{}; messages of further writers are lost", full_reason_);
  }
  recording_.add_lost(topic, bytes, full_reason_);
}

std::optional<mcap::Id> Recorder::channel(Source& source, const bus::SerializedSample& sample) {
  const std::uint64_t writer = sample.writer;
  const auto known = source.channel_of_writer.find(writer);
  if (known != source.channel_of_writer.end()) return known->second;
  // Before it describes the writer: a peer may have many, and discovery takes long.
  if (recording_.is_full()) {
    drop_without_channel(source.topic.name, sample.cdr.size());
    return std::nullopt;
  }
  std::map<std::string, std::string> metadata{{"delivery", delivery_name(source.topic.delivery)}};
  std::string node;
  if (const auto described = source.reader.writer(writer)) {
    if (is_own(*described)) return source.channel_of_writer[writer] = std::nullopt;
    node = node_of(*described);
    metadata["writer"] = described->guid;
    metadata["participant"] = described->participant_guid;
    for (const auto& [policy, value] : described->qos) metadata["qos." + policy] = value;
  }
  metadata["node"] = node;
  const mcap::Id id = recording_.add_channel(source.topic.name, source.topic.type,
                                             schema::fivepipe_schema(source.topic.type), metadata);
  ++channels_of_participant_[node];
  source.node_of_channel[id] = node;
  return source.channel_of_writer[writer] = id;
}

void Recorder::take() {
  for (const auto& source : sources_)
    source->reader.take([&](const bus::SerializedSample& sample) {
      const auto id = channel(*source, sample);
      if (!id) return;
      const std::int64_t now_ns = base::now_realtime_ns();
      if (sample.kind == bus::SampleKind::data) {
        recording_.add(*id, now_ns, sample.source_stamp_ns, sample.cdr);
        loss_detector_.received(source->node_of_channel.at(*id), source->topic.name,
                                sample.source_stamp_ns);
      } else {
        const auto change = sample.kind == bus::SampleKind::disposed
                                ? recording::KeyChange::disposed
                                : recording::KeyChange::unregistered;
        recording_.add(*id, now_ns, sample.source_stamp_ns, change, sample.cdr);
      }
    });
  take_statuses();
  recording_.tick(base::now_realtime_ns());
}

void Recorder::take_statuses() {
  for (const auto& sample : statuses_.take()) {
    if (!sample.valid() || !is_participant(sample->node)) continue;
    SentStatus status{
        sample->node, sample->start_stamp_ns, sample.source_stamp_ns(), {}, sample->final_report};
    for (const fivepipe_v1_TopicCounts& topic : messages::span_of(sample->topics))
      if (topic.sent > 0 && is_recorded(topic.topic)) status.sent[topic.topic] = topic.sent;
    loss_detector_.add_status(status);
  }
}

std::set<std::string> Recorder::unverified_nodes() const {
  return loss_detector_.unverified_nodes(base::now_realtime_ns());
}

std::vector<SentByNode> Recorder::compared() const {
  std::vector<SentByNode> all;
  for (const SentByNode& sent : loss_detector_.compared())
    // A NodeStatus counts only the statuses before it, so that topic would always differ by one.
    if (sent.topic != bus::topics::NodeStatus::name) all.push_back(sent);
  return all;
}

// A peer can publish statuses of nodes that do not exist, and losses of them.
bool Recorder::is_participant(const std::string& node) {
  if (reporting_.contains(node)) return true;
  const auto now = std::chrono::steady_clock::now();
  if (!participants_read_ || now - *participants_read_ >= kDiscoveryPeriod) {
    participants_read_ = now;
    participants_.clear();
    for (const bus::EndpointDescription& endpoint : bus_.endpoints())
      participants_.insert(endpoint.participant);
  }
  if (!participants_.contains(node)) return false;
  if (reporting_.size() < LossDetector::kMaxNodes) reporting_.insert(node);
  return true;
}

bool Recorder::is_recorded(const std::string& topic) const {
  return std::any_of(sources_.begin(), sources_.end(),
                     [&](const auto& source) { return topic == source->topic.name; });
}

}  // namespace fivepipe::replay
