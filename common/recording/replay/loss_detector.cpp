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

}  // namespace

void LossDetector::received(const std::string& name, const std::string& topic,
                            std::int64_t source_stamp_ns) {
  Node* const node = node_of(name);
  if (!node || source_stamp_ns < node->from_ns) return;
  ++node->received[topic];
  if (node->compares || node->processes.empty()) return;
  std::deque<std::int64_t>& stamps = node->stamps[topic];
  stamps.push_back(source_stamp_ns);
  if (stamps.size() > kMaxStamps) stamps.pop_front();
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
  } else if (is_new) {
    process->second.sent_before = status.sent;
  } else if (!node.compares) {
    process->second.sent_before = status.sent;
    begin(node, status.source_stamp_ns - kStatusLatency_ns);
  }
}

void LossDetector::begin(Node& node, std::int64_t from_ns) {
  node.received.clear();
  for (const auto& [topic, stamps] : node.stamps)
    node.received[topic] = std::uint64_t(std::count_if(
        stamps.begin(), stamps.end(), [&](std::int64_t stamp) { return stamp >= from_ns; }));
  node.stamps.clear();
  node.from_ns = from_ns;
  node.compares = true;
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
      const auto came = node.received.find(topic);
      all.push_back({name, topic, count, came == node.received.end() ? 0 : came->second});
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
    if (!(node.compares && is_current) && !node.received.empty()) names.insert(name);
  }
  return names;
}

}  // namespace fivepipe::replay
