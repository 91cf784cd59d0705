#include "launch/study/what_if/layout_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "common/base/text_table.h"
#include "common/config/yaml/config_error.h"
#include "launch/units/length.h"

namespace fivepipe::study {
namespace {

// Of a file that is no table, the first problems suffice.
constexpr std::size_t kMaxProblems = 10;

using Problems = std::vector<config::ConfigProblem>;

struct Cell {
  std::string text;  // without blanks around it
  int column;        // of its first character in the line, from 1
};

Cell cell_from(const std::string& line, std::size_t begin, std::size_t end) {
  const std::string blanks = " \t\r";
  while (begin < end && blanks.find(line[begin]) != std::string::npos) ++begin;
  while (begin < end && blanks.find(line[end - 1]) != std::string::npos) --end;
  return {line.substr(begin, end - begin), int(begin) + 1};
}

std::vector<Cell> cells_of(const std::string& line) {
  std::vector<Cell> cells;
  std::size_t begin = 0;
  for (std::size_t comma = line.find(','); comma != std::string::npos;
       begin = comma + 1, comma = line.find(',', begin))
    cells.push_back(cell_from(line, begin, comma));
  cells.push_back(cell_from(line, begin, line.size()));
  return cells;
}

LayoutTable::Column column_from(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) return {name, -1};
  const std::string axis = name.substr(dot + 1);
  const std::size_t index = std::string("xyz").find(axis);
  return {name.substr(0, dot), axis.size() == 1 && index != std::string::npos ? int(index) : -2};
}

std::string why_wrong(const LayoutTable::Column& column, const std::string& name,
                      const std::vector<LayoutTable::Column>& before) {
  if (column.part.empty() || column.axis < -1)
    return "column '" + base::printable(name) +
           "' is neither PART nor PART.x, PART.y or PART.z, such as payload_a or bracket.z";
  for (const LayoutTable::Column& other : before) {
    if (other.part != column.part) continue;
    if (other.axis == column.axis) return "column " + name + " is there twice";
    if (other.axis == -1 || column.axis == -1)
      return "columns " + other.name() + " and " + name +
             ": a part is placed by its spacing or by axes, not by both";
  }
  return "";
}

}  // namespace

std::string LayoutTable::Column::name() const {
  return axis < 0 ? part : part + '.' + std::string(1, char('x' + axis));
}

LayoutTable read_layout_table(const std::filesystem::path& file) {
  LayoutTable table{file, {}, {}};
  Problems problems;
  const auto problem = [&](int line, int column, const std::string& what) {
    if (problems.size() < kMaxProblems) problems.push_back({file.string(), line, column, what});
  };
  std::ifstream in(file);
  if (!std::filesystem::is_regular_file(file) || !in)
    throw config::ConfigError({{file.string(), 0, 0, "cannot be read"}});
  int line = 0;
  std::size_t columns = 0;
  for (std::string text; std::getline(in, text) && problems.size() < kMaxProblems;) {
    ++line;
    const std::vector<Cell> cells = cells_of(text);
    if (cells[0].text.starts_with('#') || (cells.size() == 1 && cells[0].text.empty())) continue;
    if (columns == 0) {
      columns = cells.size();
      for (const Cell& cell : cells) {
        const LayoutTable::Column column = column_from(cell.text);
        if (const std::string why = why_wrong(column, cell.text, table.columns); !why.empty())
          problem(line, cell.column, why);
        table.columns.push_back(column);
      }
      if (!problems.empty()) break;
      continue;
    }
    if (cells.size() != columns) {
      problem(line, 1, fmt::format("{} cells, but {} columns", cells.size(), columns));
      continue;
    }
    LayoutTable::Row row{line, {}};
    for (std::size_t i = 0; i < columns; ++i) {
      const auto& [cell, column] = cells[i];
      const auto length = length_m(cell);
      if (!length)
        problem(line, column,
                fmt::format("{}: '{}' is no length; write a number and its unit, such as 18cm, "
                            "180mm, 0.18m or 7in",
                            table.columns[i].name(), base::printable(cell)));
      else if (std::abs(*length) > kMaxTableLength_m)
        problem(line, column,
                fmt::format("{}: '{}' is longer than {:g} m", table.columns[i].name(), cell,
                            kMaxTableLength_m));
      row.cell_m.push_back(length.value_or(0));
    }
    table.rows.push_back(std::move(row));
    if (table.rows.size() > kMaxTableRows) {
      problem(line, 1, fmt::format("more than {} layouts", kMaxTableRows));
      break;
    }
  }
  if (problems.empty() && table.rows.empty())
    problem(std::max(line, 1), 1,
            "no layout: write the parts in the first line, as payload_a,bracket.z, and one "
            "layout per line below, as 18cm,5cm");
  if (!problems.empty()) throw config::ConfigError(problems);
  return table;
}

}  // namespace fivepipe::study
