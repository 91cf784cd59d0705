#include "common/config/yaml/key_suggestion.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace fivepipe::config {

namespace {

// A unit that ends with another unit precedes it, because the first match counts.
constexpr std::array kUnits = {"_m_s2", "_levels", "_sigmas", "_mm",  "_cm",      "_km",  "_inch",
                               "_in",   "_ft",     "_px",     "_deg", "_degrees", "_rad", "_hz",
                               "_fps",  "_khz",    "_ms",     "_us",  "_ns",      "_min", "_kg",
                               "_lb",   "_rgb",    "_m",      "_s",   "_g"};

// "size_cm" -> "size", "cm".
std::pair<std::string, std::string> without_unit(const std::string& key) {
  for (const std::string unit : kUnits)
    if (key.size() > unit.size() && key.ends_with(unit))
      return {key.substr(0, key.size() - unit.size()), unit.substr(1)};
  return {key, ""};
}

// Levenshtein distance.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::optional<std::string> nearest_word(const std::string& word,
                                        const std::vector<std::string>& known) {
  // At most two edits, or a third of the length of a long word.
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  std::optional<std::string> best;
  for (const std::string& candidate : known)
    if (const std::size_t distance = edit_distance(word, candidate);
        distance < best_distance && distance < candidate.size()) {
      best_distance = distance;
      best = candidate;
    }
  return best;
}

std::optional<KeySuggestion> suggest_key(const std::string& unknown,
                                         const std::vector<std::string>& known) {
  const auto [quantity, unit] = without_unit(unknown);
  for (const std::string& candidate : known) {
    const auto [known_quantity, known_unit] = without_unit(candidate);
    if (known_quantity == quantity && known_unit != unit) return KeySuggestion{candidate, true};
  }
  if (const auto nearest = nearest_word(unknown, known)) return KeySuggestion{*nearest, false};
  return std::nullopt;
}

}  // namespace fivepipe::config
