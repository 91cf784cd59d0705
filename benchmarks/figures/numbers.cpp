#include "benchmarks/figures/numbers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <sstream>

namespace fivepipe::figures {

std::string count_text(double value) {
  std::string digits = fmt::format("{:.0f}", value);
  for (std::size_t at = digits.size(); at > 3 && digits[at - 4] != '-';)
    digits.insert(at -= 3, ",");
  return digits;
}

std::string short_number(double value) {
  if (!std::isfinite(value)) return "-";
  if (value == 0) return "0";
  // 99.6 has no two digits before the point left.
  if (std::abs(value) >= 99.5) return count_text(value);
  const int decimals = 1 - int(std::floor(std::log10(std::abs(value)) + 1e-12));
  return fmt::format("{:.{}f}", value, std::max(0, decimals));
}

std::string tiny_number(double value) {
  return value != 0 && std::abs(value) < 0.01 ? fmt::format("{:.0e}", value) : short_number(value);
}

std::string error_mm(double mean_mm) {
  constexpr double kRounding_mm = 1e-4;
  return mean_mm < kRounding_mm ? "below 0.0001 mm" : short_number(mean_mm) + " mm";
}

std::string of_text(double count, double all) {
  return (count == 0 ? "none" : count_text(count)) + " of " + count_text(all);
}

MarkdownTable::MarkdownTable(const std::vector<std::string>& head) {
  add(head);
  text_ += "|";
  for (std::size_t i = 0; i < head.size(); ++i) text_ += "---|";
  text_ += "\n";
}

void MarkdownTable::add(const std::vector<std::string>& cells) {
  text_ += fmt::format("| {} |\n", fmt::join(cells, " | "));
}

namespace {

std::string wrapped_with(const std::string& text, const std::string& first,
                         const std::string& others) {
  constexpr std::size_t kColumns = 100;
  std::istringstream words(text);
  std::string lines, line = first;
  bool empty = true;
  for (std::string word; words >> word; empty = false) {
    if (!empty && line.size() + 1 + word.size() > kColumns) {
      lines += line + "\n";
      line = others;
      empty = true;
    }
    line += (empty ? "" : " ") + word;
  }
  return lines + line + "\n";
}

}  // namespace

std::string wrapped(const std::string& text) { return wrapped_with(text, "", ""); }
std::string bullet(const std::string& text) { return wrapped_with(text, "- ", "  "); }

}  // namespace fivepipe::figures
