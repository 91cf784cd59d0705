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

// The same for drops, by text_of(BadMessage). Adds the sum of the remaining ones of a reason as
// "REASON: other", so that the sum of each reason stays right, for at most kMaxReasons reasons: a
// peer can publish the status of a node with invented reasons.
inline constexpr std::size_t kMaxReasons = 32;
Counts largest_drops(const Counts& drops);

// Returns the counts of messages that a node refused, by the process that sent them, from the
// counts of its status.
Counts refused_from(const Counts& counts);

}  // namespace fivepipe::launch
