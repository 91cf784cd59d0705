// Text in columns for a terminal.
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
    bool right = false;         // aligns to the right, for numbers
    std::size_t max_width = 0;  // a longer cell wraps after ", "; 0: no limit
    std::size_t min_width = 0;  // keeps the columns in place when a table is redrawn
  };
  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

  // Takes one cell per column.
  void add(std::vector<std::string> cells);
  bool empty() const { return rows_.empty(); }
  // Returns the head and the rows, each line with a newline. Two blanks separate columns; lines
  // have no trailing blanks.
  std::string text() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::vector<std::string>>> rows_;  // row, column, line
};

// Replaces control characters by '?'. Use it for text from files and from the network.
std::string printable(std::string text);
std::string with_decimals(double value, int decimals);  // "-" if the value is NaN or infinite
std::string joined(const std::vector<std::string>& parts, const std::string& between);
// Returns "1 message" or "2 messages" if `what` is "message".
std::string counted(std::uint64_t count, const std::string& what);

}  // namespace fivepipe::base
