// What a user meant by a key that is not known.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::config {

// The known key that `unknown` most likely stands for: the same quantity in another unit or without
// one, or a slip of the pen.
struct KeySuggestion {
  std::string key;
  bool unit_differs = false;
};
std::optional<KeySuggestion> suggest_key(const std::string& unknown,
                                         const std::vector<std::string>& known);

// The nearest of `known` by spelling; nothing where none is near.
std::optional<std::string> nearest_word(const std::string& word,
                                        const std::vector<std::string>& known);

}  // namespace fivepipe::config
