#include "launch/inspect/topic_list.h"

#include "common/base/text_table.h"
#include "launch/inspect/topic_resolver.h"
#include "launch/supervise/hosts/conflicts.h"

namespace fivepipe::launch {
namespace {

constexpr std::size_t kPeersWidth = 15, kFileWritersWidth = 24, kNodeTopicsWidth = 48;
// Leading digits of a GUID that distinguish participants without a name.
constexpr std::size_t kGuidDigits = 8;

std::string name_or_guid(const std::string& name, const std::string& guid) {
  if (run_of_participant(name)) return "fivepipe up";
  if (!name.empty()) return name;
  return guid.empty() ? "?" : "(" + guid.substr(0, kGuidDigits) + ")";
}

std::string value_or_empty(const std::map<std::string, std::string>& values,
                           const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? "" : found->second;
}

std::vector<ListedTopic> values_of(std::map<std::string, ListedTopic> by_name) {
  std::vector<ListedTopic> topics;
  for (auto& [name, topic] : by_name) {
    topic.topic = name;
    topics.push_back(std::move(topic));
  }
  return topics;
}

std::string text_of(const std::map<std::string, int>& peers) {
  std::vector<std::string> parts;
  for (const auto& [name, count] : peers)
    parts.push_back(count == 1 ? name : name + " x" + std::to_string(count));
  return parts.empty() ? "-" : base::joined(parts, ", ");
}

std::string text_of(const std::set<std::string>& values) {
  return values.empty() ? "-" : base::joined({values.begin(), values.end()}, " / ");
}

}  // namespace

std::vector<ListedTopic> topics_of(const std::vector<bus::EndpointDescription>& endpoints) {
  std::map<std::string, ListedTopic> topics;
  for (const bus::EndpointDescription& endpoint : endpoints) {
    if (endpoint.own) continue;
    ListedTopic& topic = topics[endpoint.topic];
    topic.types.insert(endpoint.type);
    // Readers request weaker QoS than they get, so the list shows the writers' QoS.
    if (endpoint.writes) topic.qos.insert(short_qos(endpoint.qos));
    ++(endpoint.writes
           ? topic.writers
           : topic.readers)[name_or_guid(endpoint.participant, endpoint.participant_guid)];
  }
  return values_of(std::move(topics));
}

std::vector<ListedTopic> topics_of(const recording::Recording& recording) {
  std::map<std::string, ListedTopic> topics;
  for (const recording::RecordedChannel& channel : recording.channels()) {
    if (channel.key_states) continue;
    ListedTopic& topic = topics[channel.topic];
    topic.types.insert(channel.type);
    std::map<std::string, std::string> qos;
    for (const auto& [key, value] : channel.metadata)
      if (key.starts_with("qos.")) qos[key.substr(4)] = value;
    if (!qos.empty()) topic.qos.insert(short_qos(qos));
    ++topic.writers[name_or_guid(channel.node, channel.writer)];
    topic.messages += channel.messages;
  }
  return values_of(std::move(topics));
}

std::string short_qos(const std::map<std::string, std::string>& qos) {
  std::vector<std::string> parts;
  const std::string reliability = value_or_empty(qos, "reliability"),
                    history = value_or_empty(qos, "history"),
                    durability = value_or_empty(qos, "durability");
  if (!reliability.empty()) parts.push_back(reliability.substr(0, reliability.find(',')));
  if (!history.empty()) parts.push_back(history.starts_with("keep_") ? history.substr(5) : history);
  if (!durability.empty() && durability != "volatile")
    parts.push_back(durability == "transient_local" ? "latched" : durability);
  return base::joined(parts, ", ");
}

std::string topics_text(const std::vector<ListedTopic>& topics, bool of_recording) {
  using Column = base::TextTable::Column;
  base::TextTable table(
      {{"topic"},
       {"type"},
       {"QoS"},
       Column{"writers", false, of_recording ? kFileWritersWidth : kPeersWidth},
       of_recording ? Column{"messages", true} : Column{"readers", false, kPeersWidth}});
  for (const ListedTopic& topic : topics)
    table.add({topic.topic, text_of(topic.types), text_of(topic.qos), text_of(topic.writers),
               of_recording ? std::to_string(topic.messages) : text_of(topic.readers)});
  return table.text();
}

std::string nodes_text(const std::vector<ListedTopic>& topics, bool of_recording) {
  std::map<std::string, std::map<std::string, int>> written, read;
  std::set<std::string> nodes;
  const auto add = [&](const ListedTopic& topic, const std::map<std::string, int>& peers,
                       auto& by_node) {
    for (const auto& [node, count] : peers) {
      nodes.insert(node);
      by_node[node][base_name(topic.topic)] += count;
    }
  };
  for (const ListedTopic& topic : topics) {
    add(topic, topic.writers, written);
    add(topic, topic.readers, read);
  }
  std::vector<base::TextTable::Column> columns{{"node"}, {"writes", false, kNodeTopicsWidth}};
  if (!of_recording) columns.push_back({"reads", false, kNodeTopicsWidth});
  base::TextTable table(columns);
  for (const std::string& node : nodes) {
    std::vector<std::string> cells{node, text_of(written[node])};
    if (!of_recording) cells.push_back(text_of(read[node]));
    table.add(cells);
  }
  return table.text();
}

}  // namespace fivepipe::launch
