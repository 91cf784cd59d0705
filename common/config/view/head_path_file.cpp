#include <fmt/ranges.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "common/base/readable_file.h"
#include "common/config/view/head_path.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

namespace {

constexpr std::array<const char*, 7> kColumns = {"t_s",        "eye_x_m",    "eye_y_m",   "eye_z_m",
                                                 "target_x_m", "target_y_m", "target_z_m"};

struct Cell {
  std::string text;
  int column;  // of its first character, from 1
};

std::vector<Cell> cells_of(const std::string& line) {
  std::vector<Cell> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t comma = std::min(line.find(',', at), line.size());
    std::size_t first = at, end = comma;
    while (first < end && line[first] == ' ') ++first;
    while (end > first && line[end - 1] == ' ') --end;
    cells.push_back({line.substr(first, end - first), int(first) + 1});
    at = comma + 1;
  }
  return cells;
}

void check_header(const std::filesystem::path& file, const std::string& line, Problems& problems) {
  const std::vector<Cell> cells = cells_of(line);
  for (std::size_t i = 0; i < kColumns.size(); ++i)
    if (i >= cells.size() || cells[i].text != kColumns[i]) {
      problems.add(file, {1, i < cells.size() ? cells[i].column : int(line.size()) + 1},
                   fmt::format("the first line must be {}", fmt::join(kColumns, ",")));
      return;
    }
  if (cells.size() > kColumns.size())
    problems.add(
        file, {1, cells[kColumns.size()].column},
        fmt::format("the first line must have {} columns, has {}", kColumns.size(), cells.size()));
}

// Reads one line. Adds its problems and returns nullopt if it has any.
std::optional<HeadKey> read_key(const std::filesystem::path& file, int line_number,
                                const std::string& line, Problems& problems) {
  const std::size_t problems_before = problems.count();
  const std::vector<Cell> cells = cells_of(line);
  if (cells.size() != kColumns.size())
    problems.add(
        file, {line_number, 1},
        fmt::format("the line must have {} columns, has {}", kColumns.size(), cells.size()));
  std::array<double, kColumns.size()> values = {};
  for (std::size_t i = 0; i < std::min(cells.size(), kColumns.size()); ++i) {
    const std::string& text = cells[i].text;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), values[i]);
    if (end != text.data() + text.size() || error != std::errc() || !std::isfinite(values[i]))
      problems.add(file, {line_number, cells[i].column},
                   std::string(kColumns[i]) + " must be a finite number, is \"" + text + '"');
  }
  if (problems.count() > problems_before) return std::nullopt;
  return HeadKey{values[0], {values[1], values[2], values[3]}, {values[4], values[5], values[6]}};
}

}  // namespace

std::vector<HeadKey> read_head_path(const std::filesystem::path& file, Problems& problems) {
  std::vector<HeadKey> path;
  if (const auto why = base::why_unreadable(file)) {
    problems.add(file, {}, *why);
    return path;
  }
  const std::size_t problems_before = problems.count();
  std::vector<int> line_of_key;
  std::ifstream in(file);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.ends_with('\r')) line.pop_back();
    if (number == 1) {
      check_header(file, line, problems);
    } else if (!line.empty()) {
      if (const auto key = read_key(file, number, line, problems)) {
        path.push_back(*key);
        line_of_key.push_back(number);
      }
    }
  }
  if (problems.count() > problems_before) return path;
  if (path.empty())
    problems.add(file, {1, 1}, "the file contains no key: add a line below the header");
  for (const HeadPathFault& fault : head_path_faults(path))
    problems.add(file, {line_of_key[fault.key], 1}, fault.what);
  return path;
}

}  // namespace fivepipe::config
