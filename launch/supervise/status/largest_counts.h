// Shortens tables of counts whose names other processes state.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace fivepipe::launch {

using Counts = std::map<std::string, std::uint64_t>;

// A report or a screen shows at most this many counts of a table.
inline constexpr std::size_t kMaxShownCounts = 64;

// Returns the largest counts, at most `max_count`. Adds the sum of the remaining ones as "other".
Counts largest(const Counts& counts, std::size_t max_count = kMaxShownCounts);

// Returns the counts of messages that a node refused, by the process that sent them, from the
// counts of its status.
Counts refused_from(const Counts& counts);

}  // namespace fivepipe::launch
