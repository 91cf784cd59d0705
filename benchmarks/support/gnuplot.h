// Plots by gnuplot: the numbers as blocks in a data file, one line a series.
#pragma once
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace fivepipe::bench {

struct PlotPoint {
  double x, y;
};
using Series = std::map<std::string, std::vector<PlotPoint>>;  // by title

// Four plots at most, in two columns; one alone has the page.
class Plots {
 public:
  explicit Plots(const std::filesystem::path& file) : file_(file) {}  // .png or .svg
  void add(const std::string& settings, const Series& series);  // settings: gnuplot's, one line
  // Writes the file, and the script (.gp) and numbers (.dat) beside it. False where gnuplot is not
  // there; the script can be run elsewhere. Throws std::runtime_error where files can't be written.
  bool draw() const;

 private:
  std::filesystem::path beside(const char* extension) const {
    return std::filesystem::path(file_).replace_extension(extension);
  }
  std::filesystem::path file_;
  std::ostringstream text_, blocks_;
  int index_ = 0, plots_ = 0;
};

}  // namespace fivepipe::bench
