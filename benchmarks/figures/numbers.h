// Numbers and tables in Markdown.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::figures {

// Two significant digits below 100, else a whole number with commas: 0.11, 2.1, 72, 3,317.
std::string short_number(double value);
std::string tiny_number(double value);          // as short_number(); below 0.01: 7e-14
std::string count_text(double value);           // 1,304
std::string error_mm(double mean_mm);           // "1.6 mm", "below 0.0001 mm"
std::string of_text(double count, double all);  // "none of 2,000", "12 of 2,000"

class MarkdownTable {
 public:
  explicit MarkdownTable(const std::vector<std::string>& head);
  void add(const std::vector<std::string>& cells);
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

// Breaks the text at blanks into lines of at most 100 columns. Ends with a newline.
std::string wrapped(const std::string& text);
std::string bullet(const std::string& text);  // the same as an item of a list

}  // namespace fivepipe::figures
