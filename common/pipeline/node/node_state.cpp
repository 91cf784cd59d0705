#include "common/pipeline/node/node_state.h"

#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::node {
namespace {

using messages::set_truncated;

// Returns the q quantile (0..1). `sorted` must not be empty.
double quantile(const std::vector<float>& sorted, double q) {
  return sorted[std::min(sorted.size() - 1, std::size_t(q * double(sorted.size())))];
}

fivepipe_v1_DropCount drop_count(const messages::BadMessage& bad, std::uint64_t n) {
  fivepipe_v1_DropCount drop{};
  set_truncated(drop.reason, bad.reason);
  set_truncated(drop.subject, bad.subject);
  set_truncated(drop.detail, bad.detail);
  drop.count = n;
  return drop;
}

fivepipe_v1_TopicCounts topic_counts(const std::string& topic, const TopicTotals& totals) {
  fivepipe_v1_TopicCounts counts{};
  set_truncated(counts.topic, topic);
  counts.sent = totals.sent;
  counts.not_sent = totals.not_sent;
  counts.received = totals.recorded.received;
  counts.recorded = totals.recorded.recorded;
  counts.lost = totals.recorded.lost;
  return counts;
}

fivepipe_v1_LatencySummary latency_summary(const std::string& name, const LatencyWindow& window) {
  std::vector<float> sorted = window.newest_ms;
  std::sort(sorted.begin(), sorted.end());
  fivepipe_v1_LatencySummary summary{};
  set_truncated(summary.name, name);
  summary.p50_ms = quantile(sorted, 0.50);
  summary.p95_ms = quantile(sorted, 0.95);
  summary.p99_ms = quantile(sorted, 0.99);
  summary.max_ms = sorted.back();
  summary.count = window.count;
  return summary;
}

}  // namespace

void LatencyWindow::add(double ms) {
  if (newest_ms.size() < kMax)
    newest_ms.push_back(float(ms));
  else
    newest_ms[count % kMax] = float(ms);
  ++count;
}

StatusLists::StatusLists(const NodeState& state) {
  for (const auto* named : {&state.counts, &state.refused.counts()})
    for (const auto& [name, n] : *named) {
      set_truncated(counts_.emplace_back().name, name);
      counts_.back().count = n;
    }
  for (const auto& [bad, n] : state.drops.counts()) drops_.push_back(drop_count(bad, n));
  for (const auto& [topic, totals] : state.topics) topics_.push_back(topic_counts(topic, totals));
  for (const auto& [camera, frames] : state.empty_cameras) {
    set_truncated(empty_cameras_.emplace_back().camera, camera);
    empty_cameras_.back().frames = frames;
  }
  for (const auto& [object, totals] : state.collisions) {
    fivepipe_v1_ObjectCollisionCounts& entry = collisions_.emplace_back();
    set_truncated(entry.object, object);
    entry.frames = totals.frames;
    entry.points = totals.points;
    entry.first_contacts = totals.first_contacts;
  }
  for (const auto& [name, window] : state.latencies)
    latencies_.push_back(latency_summary(name, window));
  for (const auto& [subject, text] : state.diagnostics) {
    set_truncated(diagnostics_.emplace_back().subject, subject);
    set_truncated(diagnostics_.back().text, text);
  }
}

void StatusLists::lend_to(fivepipe_v1_NodeStatus& message) {
  messages::borrow(message.counts, counts_);
  messages::borrow(message.drops, drops_);
  messages::borrow(message.topics, topics_);
  messages::borrow(message.empty_cameras, empty_cameras_);
  messages::borrow(message.collisions, collisions_);
  messages::borrow(message.latencies, latencies_);
  messages::borrow(message.diagnostics, diagnostics_);
}

}  // namespace fivepipe::node
