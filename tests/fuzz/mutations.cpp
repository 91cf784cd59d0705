#include "tests/fuzz/mutations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <limits>
#include <utility>

namespace fivepipe::fuzz {
namespace {

constexpr std::size_t kMaxBytes = 1 << 18;  // of an input, which repetitions would let grow

// Values and signs that YAML, or the checks behind it, treat specially.
const std::vector<std::string_view> kYamlWords = {"~",
                                                  "null",
                                                  "true",
                                                  "false",
                                                  "yes",
                                                  "[]",
                                                  "{}",
                                                  "[",
                                                  "]",
                                                  "{",
                                                  "}",
                                                  ",",
                                                  ":",
                                                  "-",
                                                  "?",
                                                  "|",
                                                  ">",
                                                  ">-",
                                                  "&a",
                                                  "*a",
                                                  "*b",
                                                  "&a [*a]",
                                                  "{&a x: *a}",
                                                  "<<: *a",
                                                  "!!binary x",
                                                  "!!str",
                                                  "!<x>",
                                                  "!",
                                                  "%YAML 1.2",
                                                  "%TAG ! !",
                                                  "---",
                                                  "...",
                                                  "#",
                                                  "'",
                                                  "\"",
                                                  "\"\\x\"",
                                                  "\"\\u12\"",
                                                  "\"\\0\"",
                                                  "\"\\UFFFFFFFF\"",
                                                  "\t",
                                                  "\r",
                                                  "\n",
                                                  "\xEF\xBB\xBF",
                                                  "\xFE\xFF",
                                                  "\xFF",
                                                  "\xC0\x80",
                                                  "\xE2\x80\xA8",
                                                  "@",
                                                  "`",
                                                  "${data}",
                                                  "${",
                                                  "}",
                                                  "${x}",
                                                  "../",
                                                  "/",
                                                  "/dev/null",
                                                  ".",
                                                  "",
                                                  "synthetic",
                                                  "auto",
                                                  "world",
                                                  "viewer",
                                                  "dynamic",
                                                  "bounce",
                                                  "none",
                                                  "look_at",
                                                  "mesh",
                                                  "box"};

// Concatenates words at random.
std::string made_of(Random& random, const std::vector<std::string_view>& words) {
  std::string text;
  for (std::size_t n = 1 + below(random, 40); n > 0; --n) {
    text += any_of(random, words);
    text += any_of(random, std::array{" ", "\n", "", "\n  ", ": ", "\n- ", ", "});
  }
  return text;
}

// Encodes each byte as a unit of UTF-16 or UTF-32, which yaml-cpp detects by the first bytes.
std::string in_wide_units(Random& random, const std::string& text) {
  const std::size_t unit_bytes = one_in(random, 2) ? 2 : 4;
  const bool is_big_endian = one_in(random, 2);
  std::string wide;
  const auto append = [&](std::uint32_t unit) {
    for (std::size_t i = 0; i < unit_bytes; ++i)
      wide += char(unit >> 8 * (is_big_endian ? unit_bytes - 1 - i : i) & 0xff);
  };
  if (one_in(random, 2)) append(0xFEFF);
  for (const char c : text) append(one_in(random, 500) ? random() : std::uint8_t(c));
  return wide;
}

std::size_t place(Random& random, const std::string& text) {
  return below(random, text.size() + 1);
}

std::string piece_of(Random& random, const std::string& bytes, std::size_t max_bytes) {
  const std::size_t from = place(random, bytes);
  return bytes.substr(from, below(random, max_bytes) + 1);
}

// Returns the bounds of a random line, with its line break.
std::pair<std::size_t, std::size_t> any_line(Random& random, const std::string& text) {
  const std::size_t at = place(random, text);
  const std::size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  return {begin, std::min(text.find('\n', begin), text.size() - 1) + 1};
}

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '-';
}

std::uint64_t any_bits(Random& random) {
  const std::uint64_t high = random();
  return high << 32 | random();
}

}  // namespace

std::uint64_t interesting_integer(Random& random) {
  switch (below(random, 6)) {
    case 0: return 0;
    case 1: return ~std::uint64_t(0) - below(random, 3);
    case 2: {
      const std::uint64_t power = std::uint64_t(1) << below(random, 64);
      return power - below(random, 2);
    }
    case 3: {
      const std::uint64_t power = std::uint64_t(1) << below(random, 64);
      return power + below(random, 2);
    }
    case 4: return below(random, 256);
    default: return any_bits(random);
  }
}

double interesting_double(Random& random) {
  using Limits = std::numeric_limits<double>;
  constexpr std::array kSpecial = {0.0,
                                   -0.0,
                                   1.0,
                                   -1.0,
                                   0.5,
                                   Limits::quiet_NaN(),
                                   Limits::infinity(),
                                   -Limits::infinity(),
                                   Limits::max(),
                                   Limits::lowest(),
                                   Limits::min(),
                                   Limits::denorm_min(),
                                   Limits::epsilon(),
                                   1e-6,
                                   1e9,
                                   2147483648.0,
                                   -2147483649.0,
                                   9007199254740993.0};
  switch (below(random, 4)) {
    case 0: return std::bit_cast<double>(any_bits(random));
    case 1: return (double(random()) / 4294967296.0 - 0.5) * 4;
    default: return any_of(random, kSpecial);
  }
}

std::string number_text(Random& random) {
  static const std::vector<std::string_view> kTexts = {
      "nan",    ".nan", ".inf", "-.inf", "inf", "1e999", "-1e999",
      "1e-999", "0x10", "0o7",  "1_000", "+1",  "--1",   "1.",
      ".5",     "1,5",  "1e",   "-0",    "00",  "1 2",   "99999999999999999999"};
  switch (below(random, 4)) {
    case 0: return std::string(any_of(random, kTexts));
    case 1: return fmt::format("{}", std::int64_t(interesting_integer(random)));
    case 2: return fmt::format("{}", interesting_double(random));
    default: return fmt::format("{}", double(below(random, 2000)) / 100);
  }
}

void mutate_bytes(Random& random, std::string& bytes) {
  if (bytes.empty()) bytes = "\n";
  const auto any_place = [&] { return below(random, bytes.size()); };
  switch (below(random, 9)) {
    case 0: bytes[any_place()] ^= char(1 << below(random, 8)); break;
    case 1: bytes[any_place()] = char(random()); break;
    case 2: bytes.resize(any_place()); break;
    case 3: {
      const std::size_t at = any_place();
      bytes.erase(at, 1 + below(random, 64));
      break;
    }
    case 4: {
      const std::size_t at = any_place();
      bytes.insert(at, piece_of(random, bytes, 64));
      break;
    }
    case 5: {  // overwrites a number of 1 to 8 bytes
      const std::uint64_t number = interesting_integer(random);
      const std::size_t at = any_place(), size = std::size_t(1) << below(random, 4);
      std::memcpy(bytes.data() + at, &number, std::min(size, bytes.size() - at));
      break;
    }
    case 6: {  // overwrites a float
      const float number = float(interesting_double(random));
      const std::size_t at = any_place();
      std::memcpy(bytes.data() + at, &number, std::min(sizeof number, bytes.size() - at));
      break;
    }
    case 7: {  // repeats a piece
      const std::size_t at = any_place();
      const std::string piece = piece_of(random, bytes, 32);
      for (std::size_t n = std::size_t(1) << below(random, 12);
           n > 0 && bytes.size() + piece.size() <= kMaxBytes; --n)
        bytes.insert(at, piece);
      break;
    }
    default: {
      const std::size_t at = any_place(), count = 1 + below(random, 16);
      bytes.insert(at, count, char(random()));
    }
  }
}

void mutate_word(Random& random, std::string& text, const std::vector<std::string_view>& words) {
  if (text.empty()) return;
  std::size_t begin = below(random, text.size());
  while (begin < text.size() && !is_word(text[begin])) ++begin;
  while (begin > 0 && is_word(text[begin - 1])) --begin;
  std::size_t end = begin;
  while (end < text.size() && is_word(text[end])) ++end;
  const std::string word = text.substr(begin, end - begin);
  const bool is_number = !word.empty() && word.find_first_of("0123456789") != std::string::npos;
  const bool use_number = is_number ? !one_in(random, 5) : one_in(random, 5);
  text.replace(begin, end - begin,
               use_number ? number_text(random) : std::string(any_of(random, words)));
}

void mutate_number(Random& random, std::string& text) {
  struct Span {
    std::size_t begin, size;
  };
  std::vector<Span> numbers;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at;
    while (end < text.size() && is_word(text[end])) ++end;
    const bool is_number = end > at && text.find_first_not_of("0123456789.-", at) >= end &&
                           text.find_first_of("0123456789", at) < end;
    if (is_number) numbers.push_back({at, end - at});
    at = std::max(end, at + 1);
  }
  if (numbers.empty()) return;
  const auto text_of = [&](const Span& span) { return text.substr(span.begin, span.size); };
  const Span& span = any_of(random, numbers);
  const std::string old = text_of(span);
  std::string replacement;
  switch (below(random, 6)) {
    case 0: replacement = text_of(any_of(random, numbers)); break;
    case 1: replacement = old.starts_with('-') ? old.substr(1) : '-' + old; break;
    case 2: replacement = std::to_string(int(below(random, 5)) - 2); break;
    case 3:
      replacement = old + (one_in(random, 2) ? "0" : "e" + std::to_string(random() % 8));
      break;
    case 4: replacement = "0.000" + old.substr(old.find_first_not_of("-.")); break;
    default: replacement = number_text(random); break;
  }
  text.replace(span.begin, span.size, replacement);
}

void mutate_yaml(Random& random, std::string& text, const std::string& other) {
  const auto [begin, end] = any_line(random, text);
  switch (below(random, 14)) {
    case 0: text.erase(begin, end - begin); break;
    case 1: text.insert(end, text.substr(begin, end - begin)); break;
    case 2: {  // moves a line
      const std::string line = text.substr(begin, end - begin);
      text.erase(begin, end - begin);
      text.insert(any_line(random, text).first, line);
      break;
    }
    case 3: {
      const auto [from, to] = any_line(random, other);
      text.insert(begin, other.substr(from, to - from));
      break;
    }
    case 4: text.insert(begin, 1 + below(random, 6), ' '); break;
    case 5: text.erase(begin, 1 + below(random, 2)); break;
    case 6: {
      const std::size_t at = place(random, text);
      text.insert(at, any_of(random, kYamlWords));
      break;
    }
    case 7: {  // nests deeply
      const std::string_view opening = any_of(random, std::array{"[", "{", "- ", "{a: ", "? "});
      std::string nested;
      for (std::size_t n = std::size_t(1) << below(random, 13); n > 0; --n) nested += opening;
      text.insert(place(random, text), nested);
      break;
    }
    case 8: mutate_bytes(random, text); break;
    case 9: {
      const std::size_t at = one_in(random, 4) ? 0 : place(random, text);
      text.insert(at, made_of(random, kYamlWords));
      break;
    }
    case 10:
      if (one_in(random, 4))
        text = in_wide_units(random, text);
      else if (one_in(random, 4))
        text = made_of(random, kYamlWords);
      break;
    default: mutate_word(random, text, kYamlWords); break;
  }
  if (text.size() > kMaxBytes) text.resize(kMaxBytes);
}

}  // namespace fivepipe::fuzz
