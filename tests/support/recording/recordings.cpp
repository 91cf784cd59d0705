#include "tests/support/recording/recordings.h"

#include <algorithm>

#include "common/recording/schema/cdr.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;

}  // namespace

RecordingTest::RecordingTest(bool frequent_heartbeats, const std::string& deployment)
    : domain_(own_domain()),
      bus_({.domain = domain_,
            .deployment = deployment,
            .frequent_heartbeats = frequent_heartbeats}) {}

std::filesystem::path RecordingTest::recorded(double duration_s, const std::string& deployment,
                                              const std::vector<std::string>& options) {
  const std::filesystem::path file = folder_ / "recorded.mcap";
  std::vector<std::string> more = {"--duration", std::to_string(duration_s), "--record",
                                   file.string()};
  more.insert(more.end(), options.begin(), options.end());
  Deployed deployed(deployment, domain_, folder_ / "up", more);
  EXPECT_EQ(deployed.wait_for_end(kStart), 0) << deployed.said();
  return file;
}

std::unique_ptr<Program> RecordingTest::fivepipe(const std::string& name,
                                                 std::vector<std::string> words, bool typed_to) {
  words.insert(words.begin(), std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe");
  words.insert(words.end(), {"--domain", std::to_string(domain_)});
  return std::make_unique<Program>(words, folder_ / (name + std::to_string(++programs_) + ".log"),
                                   typed_to);
}

std::unique_ptr<Program> RecordingTest::node(const std::string& program, const std::string& name,
                                             const std::string& deployment,
                                             const std::vector<std::string>& options) {
  std::vector<std::string> words = {std::string(FIVEPIPE_BINARY_DIR) + "/" + program,
                                    "--deployment",
                                    deployment,
                                    "--node",
                                    name,
                                    "--domain",
                                    std::to_string(domain_),
                                    "--out",
                                    (folder_ / "out").string()};
  words.insert(words.end(), options.begin(), options.end());
  return std::make_unique<Program>(words, folder_ / (name + std::to_string(++programs_) + ".log"));
}

std::unique_ptr<Program> RecordingTest::recorder(const std::filesystem::path& file,
                                                 const std::vector<std::string>& options) {
  std::vector<std::string> words = {"record", "-o", file.string()};
  words.insert(words.end(), options.begin(), options.end());
  auto program = fivepipe("record", words);
  // The recorder creates its readers first and the writer of its status last.
  EXPECT_TRUE(eventually(bus_, 20s, [&] {
    return takes_part("recorder", true, {bus::topics::NodeStatus::name});
  })) << program->said();
  return program;
}

bool RecordingTest::takes_part(const std::string& participant, bool writes,
                               const std::set<std::string>& topics) {
  std::set<std::string> missing = topics;
  for (const bus::EndpointDescription& endpoint : bus_.endpoints())
    if (endpoint.participant == participant && endpoint.writes == writes)
      missing.erase(endpoint.topic);
  return missing.empty();
}

std::map<std::string, std::vector<WrittenByOne>> messages_by_writer(
    const recording::Recording& recording) {
  std::map<std::pair<std::string, std::string>, WrittenByOne> by_writer;
  auto cursor = recording.messages();
  while (const auto message = cursor.next())
    if (!message->key_change)
      by_writer[{message->channel->topic, message->channel->writer}].emplace_back(
          message->source_stamp_ns, Payload(message->cdr.begin(), message->cdr.end()));
  std::map<std::string, std::vector<WrittenByOne>> by_topic;
  for (auto& [of, messages] : by_writer) {
    std::sort(messages.begin(), messages.end());
    by_topic[of.first].push_back(std::move(messages));
  }
  for (auto& [topic, writers] : by_topic) std::sort(writers.begin(), writers.end());
  return by_topic;
}

std::map<std::pair<std::string, Payload>, recording::KeyChange> last_key_changes(
    const recording::Recording& recording) {
  std::map<std::pair<std::string, Payload>, recording::KeyChange> last;
  auto cursor = recording.messages();
  while (const auto message = cursor.next())
    if (message->key_change)
      last[{message->channel->topic, Payload(message->cdr.begin(), message->cdr.end())}] =
          *message->key_change;
  return last;
}

std::map<std::string, nlohmann::ordered_json> final_statuses(
    const recording::Recording& recording) {
  std::map<std::string, nlohmann::ordered_json> last;
  auto cursor = recording.messages();
  while (const auto message = cursor.next())
    if (message->channel->topic == bus::topics::NodeStatus::name && !message->key_change) {
      auto status =
          schema::decode(recording.idl(*message->channel), message->channel->type, message->cdr);
      const std::string node = status["node"];
      last[node] = std::move(status);
    }
  for (const auto& [node, status] : last) EXPECT_TRUE(status["final_report"]) << node;
  return last;
}

std::map<std::string, std::uint64_t> sent_by_topic(
    const std::map<std::string, nlohmann::ordered_json>& statuses) {
  std::map<std::string, std::uint64_t> sent;
  for (const auto& [node, status] : statuses)
    for (const auto& topic : status["topics"])
      if (const auto count = topic["sent"].get<std::uint64_t>(); count > 0)
        sent[topic["topic"]] += count;
  sent.erase(bus::topics::NodeStatus::name);  // a status does not count itself
  return sent;
}

std::map<std::string, std::uint64_t> counts_by_topic(const recording::Recording& recording) {
  std::map<std::string, std::uint64_t> counts;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (!channel.key_states) counts[channel.topic] += channel.messages;
  return counts;
}

std::map<std::uint64_t, std::uint64_t> counts_by_frame(const recording::Recording& recording,
                                                       const std::string& topic) {
  std::map<std::uint64_t, std::uint64_t> counts;
  auto cursor = recording.messages();
  while (const auto message = cursor.next())
    if (message->channel->topic == topic && !message->key_change)
      ++counts[schema::decode(recording.idl(*message->channel), message->channel->type,
                              message->cdr)["frame"]];
  return counts;
}

Outputs::Outputs(bus::Bus& bus, const std::vector<std::string>& names) {
  for (const bus::topics::Topic& topic : bus::topics::all())
    if (std::find(names.begin(), names.end(), topic.name) != names.end())
      readers_[topic.name] = std::make_unique<bus::SerializedReader>(bus, topic);
}

void Outputs::take() {
  for (const auto& [topic, reader] : readers_)
    reader->take([this, &topic = topic](const bus::SerializedSample& sample) {
      if (sample.kind == bus::SampleKind::data)
        payloads_[topic].emplace_back(sample.cdr.begin(), sample.cdr.end());
    });
}

bool Outputs::has_writers(int count) const {
  return std::all_of(readers_.begin(), readers_.end(),
                     [&](const auto& reader) { return reader.second->writers() == count; });
}

std::uint64_t Outputs::taken() const {
  std::uint64_t count = 0;
  for (const auto& [topic, payloads] : payloads_) count += payloads.size();
  return count;
}

std::map<std::string, std::vector<Payload>> Outputs::sorted() const {
  auto all = payloads_;
  for (auto& [topic, payloads] : all) std::sort(payloads.begin(), payloads.end());
  return all;
}

}  // namespace fivepipe::test
