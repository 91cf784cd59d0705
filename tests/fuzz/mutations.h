// Random damage to bytes and to YAML text.
#pragma once
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/target.h"

namespace fivepipe::fuzz {

// Returns a number in [0, count); count > 0.
inline std::size_t below(Random& random, std::size_t count) { return random() % count; }
inline bool one_in(Random& random, std::uint32_t n) { return random() % n == 0; }

template <typename Container>
const auto& any_of(Random& random, const Container& choices) {
  return choices[below(random, std::size(choices))];
}

// Returns 0, a power of two or a limit with its neighbours, or any number.
std::uint64_t interesting_integer(Random& random);
// Returns an ordinary number, a limit, NaN, an infinity, or any bits.
double interesting_double(Random& random);
// Returns a number as text: in range, out of range, or no number at all.
std::string number_text(Random& random);

// Changes the bytes once: flips, overwrites, inserts, removes, repeats or truncates.
void mutate_bytes(Random& random, std::string& bytes);

// Replaces one word or number of the text by one from `words` or by a number.
void mutate_word(Random& random, std::string& text, const std::vector<std::string_view>& words);

// Replaces one number of the text by another number of the text, its negative, or a near or special
// one, so that most keys keep their values.
void mutate_number(Random& random, std::string& text);

// Changes YAML text once: a value, a key, a line, its indentation, or bytes. `other` is another
// text, of which lines are inserted.
void mutate_yaml(Random& random, std::string& text, const std::string& other);

}  // namespace fivepipe::fuzz
