#include "launch/supervise/status/largest_counts.h"

#include <algorithm>
#include <vector>

#include "common/pipeline/node/status_names.h"

namespace fivepipe::launch {

namespace {

// Returns the counts, the largest ones first.
std::vector<std::pair<std::string, std::uint64_t>> sorted(const Counts& counts) {
  std::vector<std::pair<std::string, std::uint64_t>> entries(counts.begin(), counts.end());
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return entries;
}

}  // namespace

Counts largest(const Counts& counts, std::size_t max_count) {
  Counts kept;
  std::size_t i = 0;
  for (const auto& [name, count] : sorted(counts)) kept[i++ < max_count ? name : "other"] += count;
  return kept;
}

Counts largest_drops(const Counts& drops) {
  Counts kept;
  std::size_t i = 0;
  for (const auto& [text, count] : sorted(drops)) {
    const std::size_t reason_end = text.find(": ");
    const bool has_subject = reason_end != text.npos;
    kept[i++ < kMaxShownCounts || !has_subject ? text : text.substr(0, reason_end) + ": other"] +=
        count;
  }
  return largest(kept, kMaxShownCounts + kMaxReasons);
}

Counts refused_from(const Counts& counts) {
  const std::string prefix = node::kRefusedFrom;
  Counts refused;
  for (const auto& [name, count] : counts)
    if (name.starts_with(prefix)) refused[name.substr(prefix.size())] += count;
  return refused;
}

}  // namespace fivepipe::launch
