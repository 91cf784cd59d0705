#include "launch/study/folder/pseudonym_search.h"

#include <locale.h>
#include <wctype.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/study/report/escape.h"

namespace fivepipe::study {
namespace {

constexpr std::size_t kBlockBytes = 1 << 20;
// A letter in upper case may have more bytes than in lower case, at most four.
constexpr std::size_t kMaxGrowth = 4;

locale_t utf8_locale() {
  static const locale_t locale = newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
  return locale;
}

// A code point and its bytes; 0 bytes: none begins there.
struct CodePoint {
  std::uint32_t value = 0;
  std::size_t bytes = 0;
};

CodePoint code_point_at(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return std::uint32_t(std::uint8_t(text[i])); };
  const std::uint32_t first = byte(at);
  const std::size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : first >= 0xC2 ? 2 : 0;
  if (bytes == 0 || at + bytes > text.size()) return {};
  std::uint32_t value = first & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(at + i) & 0xC0U) != 0x80) return {};
    value = (value << 6) | (byte(at + i) & 0x3FU);
  }
  return {value, bytes};
}

void append_utf8(std::uint32_t value, std::string& text) {
  if (value < 0x80) {
    text += char(value);
    return;
  }
  const int more = value < 0x800 ? 1 : value < 0x10000 ? 2 : 3;
  text += char(((0xFF80U >> more) & 0xFFU) | (value >> (6 * more)));
  for (int i = more - 1; i >= 0; --i) text += char(0x80U | ((value >> (6 * i)) & 0x3FU));
}

std::string without_quotes(const std::string& text) { return text.substr(1, text.size() - 2); }

}  // namespace

std::string lower_case(const std::string& text) {
  std::string lower;
  lower.reserve(text.size());
  for (std::size_t at = 0; at < text.size();) {
    if (std::uint8_t(text[at]) < 0x80) {
      const char c = text[at++];
      lower += c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
      continue;
    }
    const CodePoint found = code_point_at(text, at);
    if (found.bytes == 0 || utf8_locale() == nullptr) {
      lower += text[at++];
      continue;
    }
    append_utf8(std::uint32_t(towlower_l(wint_t(found.value), utf8_locale())), lower);
    at += found.bytes;
  }
  return lower;
}

PseudonymSearch::PseudonymSearch(const std::string& pseudonym) {
  for (const std::string& form :
       {pseudonym, without_quotes(nlohmann::json(pseudonym).dump()),
        without_quotes(nlohmann::json(pseudonym).dump(-1, ' ', true)),
        without_quotes(report::script_json(pseudonym)), report::html_text(pseudonym),
        without_quotes(report::csv_text(pseudonym))}) {
    const std::string lower = lower_case(form);
    if (std::ranges::find(forms_, lower) == forms_.end()) forms_.push_back(lower);
    max_bytes_ = std::max(max_bytes_, lower.size());
  }
}

bool PseudonymSearch::is_in(const std::string& text) const {
  return is_in(' ' + lower_case(text) + ' ', true);
}

// The first and the last byte only show where a word ends.
bool PseudonymSearch::is_in(const std::string& folded, bool as_word) const {
  const auto is_letter = [&](std::size_t at) {
    return std::isalnum(std::uint8_t(folded[at])) != 0;
  };
  return std::ranges::any_of(forms_, [&](const std::string& form) {
    for (std::size_t at = folded.find(form, 1);
         at != std::string::npos && at + form.size() < folded.size();
         at = folded.find(form, at + 1))
      if (!as_word || !(is_letter(at - 1) || is_letter(at + form.size()))) return true;
    return false;
  });
}

bool PseudonymSearch::is_in_content(const std::filesystem::path& file) const {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::system_error(errno, std::generic_category(), "cannot read " + file.string());
  // In blocks, because a recording may be large. Each begins with the end of the one before.
  std::string window(1, ' '), block(kBlockBytes, '\0');
  bool is_first = true, as_word = true;
  while (in) {
    in.read(block.data(), std::streamsize(block.size()));
    const auto bytes = std::size_t(in.gcount());
    if (is_first) {
      as_word = std::find(block.begin(), block.begin() + std::ptrdiff_t(bytes), '\0') ==
                block.begin() + std::ptrdiff_t(bytes);
      if (!as_word && forms_.front().size() < kMinBinaryBytes) return false;
    }
    is_first = false;
    window.append(block, 0, bytes);
    if (!in) window += ' ';
    if (is_in(lower_case(window), as_word)) return true;
    window.erase(0, window.size() - std::min(window.size(), kMaxGrowth * max_bytes_ + 8));
  }
  return false;
}

}  // namespace fivepipe::study
