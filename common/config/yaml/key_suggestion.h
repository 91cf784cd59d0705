// Suggests the known key that a user probably meant by an unknown one.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::config {

// Returns the known key nearest to `unknown`: the same quantity with another unit or without one,
// or a misspelling. Returns nullopt if none is near.
struct KeySuggestion {
  std::string key;
  bool unit_differs = false;
};
std::optional<KeySuggestion> suggest_key(const std::string& unknown,
                                         const std::vector<std::string>& known);

// Returns the word of `known` with the smallest edit distance. Returns nullopt if none is near.
std::optional<std::string> nearest_word(const std::string& word,
                                        const std::vector<std::string>& known);

}  // namespace fivepipe::config
