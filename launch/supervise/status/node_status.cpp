#include "launch/supervise/status/node_status.h"

#include <algorithm>

namespace fivepipe::launch {
namespace {

// The last status of a process that died may arrive after the first one of its successor.
constexpr std::int64_t kStatusTimeout_ns = 1'500'000'000;

bool is_same_process(const ProcessStatus& a, const ProcessStatus& b) {
  return a.start_stamp_ns == b.start_stamp_ns &&
         (!a.process || !b.process || a.process == b.process);
}

// Returns the value of `key`, or of "other" if the key is new and the map is full.
template <class Value>
Value& entry(std::map<std::string, Value>& map, const std::string& key) {
  return map[map.contains(key) || map.size() < kMaxStatusEntries ? key : "other"];
}

template <class Value>
void add_each(std::map<std::string, Value>& sums, const std::map<std::string, Value>& older) {
  for (const auto& [key, value] : older) entry(sums, key) += value;
}

// Adds the totals of an older process.
void add_totals(ProcessStatus& sum, const ProcessStatus& older) {
  sum.cpu_s += older.cpu_s;
  sum.memory_mb = std::max(sum.memory_mb, older.memory_mb);
  add_each(sum.counts, older.counts);
  add_each(sum.drops, older.drops);
  add_each(sum.empty_cameras, older.empty_cameras);
  add_each(sum.topics, older.topics);
  add_each(sum.collisions, older.collisions);
  for (const auto& [name, latency] : older.latencies)
    if (Latency& kept = entry(sum.latencies, name); latency.count > kept.count) kept = latency;
}

}  // namespace

TopicTotals& TopicTotals::operator+=(const TopicTotals& other) {
  sent += other.sent;
  not_sent += other.not_sent;
  received += other.received;
  recorded += other.recorded;
  lost += other.lost;
  return *this;
}

CollisionTotals& CollisionTotals::operator+=(const CollisionTotals& other) {
  frames += other.frames;
  points += other.points;
  first_contacts += other.first_contacts;
  return *this;
}

void StatusRegistry::add(ProcessStatus status, std::int64_t arrived_ns) {
  if (!entries_.contains(status.node) && !make_space_for_node_of(status.process, arrived_ns)) {
    ++ignored_;
    return;
  }
  Entry& entry = entry_of(entries_[status.node], status, arrived_ns);
  if (arrived_ns > entry.arrived_ns)
    entry.cpu_percent =
        100 * (status.cpu_s - entry.newest.cpu_s) / (1e-9 * double(arrived_ns - entry.arrived_ns));
  entry.arrived_ns = arrived_ns;
  if (!status.process) status.process = entry.newest.process;
  entry.newest = std::move(status);
}

bool StatusRegistry::make_space_for_node_of(const std::optional<bus::ProcessId>& process,
                                            std::int64_t arrived_ns) {
  const auto is_of_process = [&](const auto& of_node) {
    return of_node.second[newest_of(of_node.second)].newest.process == process;
  };
  if (std::size_t(std::count_if(entries_.begin(), entries_.end(), is_of_process)) >=
      kMaxNodesOfProcess)
    return false;
  if (entries_.size() < kMaxNodes) return true;
  auto oldest = entries_.end();
  std::int64_t oldest_arrived_ns = 0;
  for (auto node = entries_.begin(); node != entries_.end(); ++node) {
    const Entry& newest = node->second[newest_of(node->second)];
    const bool is_active = !newest.newest.final_report &&
                           1e-9 * double(arrived_ns - newest.arrived_ns) <= kMaxSilence_s;
    if (is_active) continue;
    if (oldest != entries_.end() && newest.arrived_ns >= oldest_arrived_ns) continue;
    oldest = node;
    oldest_arrived_ns = newest.arrived_ns;
  }
  if (oldest == entries_.end()) return false;
  entries_.erase(oldest);
  return true;
}

StatusRegistry::Entry& StatusRegistry::entry_of(std::vector<Entry>& processes,
                                                const ProcessStatus& status,
                                                std::int64_t arrived_ns) {
  const auto known = std::find_if(processes.begin(), processes.end(), [&](const Entry& entry) {
    return is_same_process(entry.newest, status);
  });
  if (known != processes.end()) return *known;
  if (processes.size() >= kMaxProcesses) {
    const auto longest_silent = std::ranges::min_element(processes, {}, &Entry::arrived_ns);
    const auto next =
        longest_silent + 1 == processes.end() ? longest_silent - 1 : longest_silent + 1;
    add_totals(next->newest, longest_silent->newest);
    processes.erase(longest_silent);
  }
  return processes.emplace_back(Entry{status, arrived_ns, arrived_ns, 0});
}

std::map<std::string, std::vector<ProcessStatus>> StatusRegistry::processes() const {
  std::map<std::string, std::vector<ProcessStatus>> by_node;
  for (const auto& [node, entries] : entries_) {
    std::vector<ProcessStatus>& processes = by_node[node];
    for (const Entry& entry : entries) processes.push_back(entry.newest);
    const auto newest = processes.begin() + std::ptrdiff_t(newest_of(entries));
    std::rotate(newest, newest + 1, processes.end());
  }
  return by_node;
}

const ProcessStatus* StatusRegistry::newest(const std::string& node) const {
  const Entry* entry = newest_entry(node);
  return entry ? &entry->newest : nullptr;
}

std::vector<DuplicateNode> StatusRegistry::duplicates() const {
  std::vector<DuplicateNode> duplicates;
  for (const auto& [node, entries] : entries_) {
    // A process of which only the last status arrived: it died before.
    const auto is_late = [](const Entry& entry) {
      return entry.newest.final_report && entry.arrived_ns == entry.first_arrived_ns;
    };
    const auto last = std::find_if_not(entries.rbegin(), entries.rend(), is_late);  // to appear
    if (last == entries.rend()) continue;
    DuplicateNode duplicate{node, {}};
    for (const Entry& entry : entries)
      if (&entry == &*last || (!entry.newest.final_report &&
                               entry.arrived_ns > last->first_arrived_ns + kStatusTimeout_ns))
        duplicate.processes.push_back(text_of(entry.newest.process));
    if (duplicate.processes.size() > 1) duplicates.push_back(std::move(duplicate));
  }
  return duplicates;
}

double StatusRegistry::cpu_percent(const std::string& node) const {
  const Entry* newest = newest_entry(node);
  return newest ? newest->cpu_percent : 0;
}

std::optional<NodeActivity> StatusRegistry::activity(const std::string& node,
                                                     std::int64_t now_ns) const {
  const Entry* newest = newest_entry(node);
  if (!newest) return std::nullopt;
  return NodeActivity{newest->newest.final_report, 1e-9 * double(now_ns - newest->arrived_ns)};
}

std::size_t StatusRegistry::newest_of(const std::vector<Entry>& processes) {
  const std::int64_t last_ns = std::ranges::max(processes, {}, &Entry::arrived_ns).arrived_ns;
  std::size_t newest = processes.size() - 1;
  while (last_ns - processes[newest].arrived_ns > kStatusTimeout_ns) --newest;
  return newest;
}

const StatusRegistry::Entry* StatusRegistry::newest_entry(const std::string& node) const {
  const auto entries = entries_.find(node);
  return entries == entries_.end() ? nullptr : &entries->second[newest_of(entries->second)];
}

}  // namespace fivepipe::launch
