// Columns of text for a terminal.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fivepipe::base {

class TextTable {
 public:
  struct Column {
    std::string head;
    bool right = false;  // numbers
    std::size_t max_width =
        0;  // a longer cell goes on in further lines, behind ", "; 0: as wide as it is
  };
  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

  // As many cells as columns.
  void add(std::vector<std::string> cells);
  bool empty() const { return rows_.empty(); }
  // Two blanks between columns, none at the ends of lines.
  std::string text() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::vector<std::string>>> rows_;  // row, column, line
};

// What a file or a peer calls itself, fit for a terminal: control characters become '?'.
std::string printable(std::string text);
std::string with_decimals(double value, int decimals);  // "-" where it is no number
std::string joined(const std::vector<std::string>& parts, const std::string& between);
// "1 message", "2 messages"
std::string counted(std::uint64_t count, const std::string& what);

}  // namespace fivepipe::base
