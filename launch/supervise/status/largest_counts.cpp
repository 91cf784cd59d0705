#include "launch/supervise/status/largest_counts.h"

#include <algorithm>
#include <vector>

#include "common/pipeline/node/status_names.h"

namespace fivepipe::launch {

Counts largest(const Counts& counts, std::size_t max_count) {
  if (counts.size() <= max_count) return counts;
  std::vector<std::pair<std::string, std::uint64_t>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  const auto rest = sorted.begin() + std::ptrdiff_t(max_count);
  Counts kept(sorted.begin(), rest);
  for (auto at = rest; at != sorted.end(); ++at) kept["other"] += at->second;
  return kept;
}

Counts refused_from(const Counts& counts) {
  const std::string prefix = node::kRefusedFrom;
  Counts refused;
  for (const auto& [name, count] : counts)
    if (name.starts_with(prefix)) refused[name.substr(prefix.size())] += count;
  return refused;
}

}  // namespace fivepipe::launch
