#include "common/base/text_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace fivepipe::base {
namespace {

constexpr const char* kColumnGap = "  ";

// Breaks a cell after ", " into lines of at most max_width characters; 0: one line.
std::vector<std::string> lines_of(const std::string& cell, std::size_t max_width) {
  std::vector<std::string> lines{""};
  std::size_t at = 0;
  while (at < cell.size()) {
    const std::size_t comma = cell.find(", ", at);
    const std::string part = cell.substr(at, comma == std::string::npos ? comma : comma + 1 - at);
    at = comma == std::string::npos ? cell.size() : comma + 2;
    std::string& line = lines.back();
    if (line.empty())
      line = part;
    else if (max_width == 0 || line.size() + 1 + part.size() <= max_width)
      line += " " + part;
    else
      lines.push_back(part);
  }
  return lines;
}

}  // namespace

void TextTable::add(std::vector<std::string> cells) {
  std::vector<std::vector<std::string>> row;
  for (std::size_t i = 0; i < columns_.size(); ++i)
    row.push_back(lines_of(printable(std::move(cells.at(i))), columns_[i].max_width));
  rows_.push_back(std::move(row));
}

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    std::size_t width = std::max(columns_[i].head.size(), columns_[i].min_width);
    for (const auto& row : rows_)
      for (const std::string& line : row[i]) width = std::max(width, line.size());
    widths.push_back(width);
  }
  std::string text;
  const auto add_line = [&](const auto& cell_of) {
    std::string line;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const std::string cell = cell_of(i), blanks(widths[i] - cell.size(), ' ');
      line += (i == 0 ? "" : kColumnGap) + (columns_[i].right ? blanks + cell : cell + blanks);
    }
    text += line.erase(line.find_last_not_of(' ') + 1) + "\n";
  };
  add_line([&](std::size_t i) { return columns_[i].head; });
  for (const auto& row : rows_) {
    std::size_t lines = 1;
    for (const auto& cell : row) lines = std::max(lines, cell.size());
    for (std::size_t n = 0; n < lines; ++n)
      add_line([&](std::size_t i) { return n < row[i].size() ? row[i][n] : std::string(); });
  }
  return text;
}

std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, '?');
  return text;
}

std::string with_decimals(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "-";
}

std::string joined(const std::vector<std::string>& parts, const std::string& between) {
  return fmt::format("{}", fmt::join(parts, between));
}

std::string counted(std::uint64_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace fivepipe::base
