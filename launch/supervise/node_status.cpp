#include "launch/supervise/node_status.h"

#include <algorithm>

namespace fivepipe::launch {
namespace {

// The last status of a process that died may arrive after the first one of its successor.
constexpr std::int64_t kStatusTimeout_ns = 1'500'000'000;

}  // namespace

void StatusRegistry::add(ProcessStatus status, std::int64_t arrived_stamp_ns) {
  auto [at, is_new] = entries_[status.node].try_emplace(status.writer);
  Entry& entry = at->second;
  if (is_new)
    entry.first_arrived_ns = arrived_stamp_ns;
  else if (arrived_stamp_ns > entry.arrived_ns)
    entry.cpu_percent = 100 * (status.cpu_s - entry.newest.cpu_s) /
                        (1e-9 * double(arrived_stamp_ns - entry.arrived_ns));
  entry.arrived_ns = arrived_stamp_ns;
  entry.gone = status.final_report;
  entry.newest = std::move(status);
}

void StatusRegistry::writer_gone(const std::string& node) {
  for (auto& [writer, entry] : entries_[node]) entry.gone = true;
}

std::map<std::string, std::vector<ProcessStatus>> StatusRegistry::processes() const {
  std::map<std::string, std::vector<ProcessStatus>> by_node;
  for (const auto& [node, writers] : entries_) {
    if (writers.empty()) continue;
    auto& processes = by_node[node];
    for (const auto& [writer, entry] : writers) processes.push_back(entry.newest);
    std::stable_sort(processes.begin(), processes.end(), [](const auto& a, const auto& b) {
      return a.start_stamp_ns < b.start_stamp_ns;
    });
  }
  return by_node;
}

std::vector<std::string> StatusRegistry::duplicates() const {
  std::vector<std::string> nodes;
  for (const auto& [node, writers] : entries_) {
    const Entry* newest = newest_entry(node);
    const bool another_lives = std::any_of(writers.begin(), writers.end(), [&](const auto& pair) {
      const Entry& entry = pair.second;
      return &entry != newest && !entry.newest.final_report &&
             entry.arrived_ns > newest->first_arrived_ns + kStatusTimeout_ns;
    });
    if (another_lives) nodes.push_back(node);
  }
  return nodes;
}

double StatusRegistry::cpu_percent(const std::string& node) const {
  const Entry* newest = newest_entry(node);
  return newest ? newest->cpu_percent : 0;
}

std::vector<std::string> StatusRegistry::alive(std::int64_t now_ns, std::int64_t max_age_ns) const {
  std::vector<std::string> nodes;
  for (const auto& [node, writers] : entries_)
    if (const Entry* newest = newest_entry(node);
        newest && !newest->gone && now_ns - newest->arrived_ns <= max_age_ns)
      nodes.push_back(node);
  return nodes;
}

const StatusRegistry::Entry* StatusRegistry::newest_entry(const std::string& node) const {
  const auto writers = entries_.find(node);
  if (writers == entries_.end()) return nullptr;
  const Entry* newest = nullptr;
  for (const auto& [writer, entry] : writers->second)
    if (!newest || entry.newest.start_stamp_ns > newest->newest.start_stamp_ns) newest = &entry;
  return newest;
}

}  // namespace fivepipe::launch
