#include "common/recording/replay/loss_detector.h"

#include <algorithm>

#include "common/base/realtime.h"

namespace fivepipe::replay {
namespace {

// Maximum time from when a node reads its send counts to the timestamp of the NodeStatus that
// contains them (the node sorts latencies in between). For a process that ran before the recorder,
// neither count includes the messages sent in this time. The detector misses their loss, once per
// process.
constexpr std::int64_t kStatusLatency_ns = 100'000'000;
// Nodes publish their status twice per second.
constexpr std::int64_t kMaxSilence_ns = 2'000'000'000;
// Maximum time from the second status of a process that ran before to the first message of a topic
// whose reader matches late. Measured with DDS Security, the address sanitizer and two busy cores:
// messages of the first 0.6 s were missing. 10 s allow for machines that are 16 times slower.
constexpr std::int64_t kMaxLateMatch_ns = 10'000'000'000;

}  // namespace

void LossDetector::received(const std::string& name, const std::string& topic_name,
                            std::int64_t source_stamp_ns) {
  Node* const node = node_of(name);
  if (!node) return;
  const auto [entry, is_new] = node->topics.try_emplace(topic_name);
  Topic& topic = entry->second;
  if (is_new) topic.from_ns = node->from_ns;
  if (source_stamp_ns < topic.from_ns) return;
  ++topic.received;
  if (!topic.first_ns) topic.first_ns = source_stamp_ns;
  const bool is_final = node->compares && (topic.is_compared || !node->late_match_since_ns);
  if (is_final || node->processes.empty()) return;
  topic.stamps.push_back(source_stamp_ns);
  if (topic.stamps.size() > kMaxStamps) topic.stamps.pop_front();
}

LossDetector::Node* LossDetector::node_of(const std::string& name) {
  const auto known = nodes_.find(name);
  if (known != nodes_.end()) return &known->second;
  if (nodes_.size() < kMaxNodes) return &nodes_[name];
  ignores_nodes_ = true;
  return nullptr;
}

void LossDetector::add_status(const SentStatus& status) {
  if (status.source_stamp_ns < start_stamp_ns_) return;
  Node* const known = node_of(status.node);
  if (!known || (!known->processes.contains(status.start_stamp_ns) &&
                 known->processes.size() >= kMaxProcesses))
    return;
  Node& node = *known;
  node.newest = status;
  const auto [process, is_new] = node.processes.try_emplace(status.start_stamp_ns);
  process->second.sent = status.sent;
  if (status.start_stamp_ns >= start_stamp_ns_) {
    if (!node.compares && node.processes.size() > 1)
      begin(node, status.start_stamp_ns);  // the previous process sent only one status
    node.compares = true;
    if (node.late_match_since_ns && is_new) {  // this process replaces one that ran before
      begin_late_topics(node, status.start_stamp_ns, LateTopics::all);
      end_late_matches(node);
    }
  } else if (is_new) {
    process->second.sent_before = status.sent;
  } else if (!node.compares) {
    process->second.sent_before = status.sent;
    begin(node, status.source_stamp_ns - kStatusLatency_ns);
    node.late_match_since_ns = status.source_stamp_ns;
  } else if (node.late_match_since_ns) {
    const std::int64_t from_ns = status.source_stamp_ns - kStatusLatency_ns;
    begin_late_topics(node, from_ns, LateTopics::arrived);
    if (base::difference_ns(from_ns, *node.late_match_since_ns) > kMaxLateMatch_ns)
      end_late_matches(node);
  }
}

// Counts from at_ns on. That is final if a message from before it was received.
void LossDetector::Topic::begin(std::int64_t at_ns) {
  std::erase_if(stamps, [&](std::int64_t stamp) { return stamp < at_ns; });
  received = stamps.size();
  from_ns = at_ns;
  is_compared = first_ns && *first_ns <= at_ns;
  if (is_compared) stamps.clear();
}

void LossDetector::begin(Node& node, std::int64_t from_ns) {
  for (auto& [name, topic] : node.topics) topic.begin(from_ns);
  node.from_ns = from_ns;
  node.compares = true;
}

// The newest statuses of the processes that ran before must count just their messages before
// from_ns. (Of two such processes at a time, the count of one is up to 0.5 s old.)
void LossDetector::begin_late_topics(Node& node, std::int64_t from_ns, LateTopics which) {
  const auto begins = [&](const std::string& name) {
    const auto known = node.topics.find(name);
    if (which == LateTopics::all) return known == node.topics.end() || !known->second.is_compared;
    return known != node.topics.end() && node.awaits_status(known->second) &&
           *known->second.first_ns <= from_ns &&
           base::difference_ns(*known->second.first_ns, *node.late_match_since_ns) <=
               kMaxLateMatch_ns;
  };
  for (auto& [start, process] : node.processes)
    if (start < start_stamp_ns_)
      for (const auto& [name, count] : process.sent)
        if (begins(name)) process.sent_before[name] = count;
  for (auto& [name, topic] : node.topics)
    if (begins(name)) topic.begin(from_ns);
  if (which == LateTopics::all) node.from_ns = from_ns;
}

// The topics that have not begun stay compared from the second status on.
void LossDetector::end_late_matches(Node& node) {
  node.late_match_since_ns.reset();
  for (auto& [name, topic] : node.topics) topic.stamps.clear();
}

bool LossDetector::Node::awaits_status(const Topic& topic) const {
  return late_match_since_ns && topic.first_ns && !topic.is_compared;
}

std::vector<SentByNode> LossDetector::compared() const {
  std::vector<SentByNode> all;
  for (const auto& [name, node] : nodes_) {
    if (!node.compares) continue;
    std::map<std::string, std::uint64_t> sent;
    for (const auto& [start, process] : node.processes)
      for (const auto& [topic, count] : process.sent) {
        const auto before = process.sent_before.find(topic);
        sent[topic] += count - (before == process.sent_before.end() ? 0 : before->second);
      }
    for (const auto& [topic, count] : sent) {
      const auto known = node.topics.find(topic);
      if (known == node.topics.end())
        all.push_back({name, topic, count, 0});
      else if (!node.awaits_status(known->second))
        all.push_back({name, topic, count, known->second.received});
    }
  }
  return all;
}

std::set<std::string> LossDetector::unverified_nodes(std::int64_t now_ns) const {
  std::set<std::string> names;
  if (ignores_nodes_) names.insert(kFurtherNodes);
  for (const auto& [name, node] : nodes_) {
    const bool is_current =
        node.newest.final_report ||
        base::difference_ns(now_ns, node.newest.source_stamp_ns) < kMaxSilence_ns;
    const bool awaits_status = std::ranges::any_of(
        node.topics, [&of = node](const auto& topic) { return of.awaits_status(topic.second); });
    if ((!(node.compares && is_current) && !node.topics.empty()) || awaits_status)
      names.insert(name);
  }
  return names;
}

}  // namespace fivepipe::replay
