// Plots by gnuplot: a script, and one data file with a block per series.
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
using Series = std::map<std::string, std::vector<PlotPoint>>;  // keyed by title

// Holds at most four plots, in two columns. A single plot fills the image.
class Plots {
 public:
  explicit Plots(const std::filesystem::path& file) : file_(file) {}  // .png or .svg
  // `settings` are gnuplot commands in one line.
  void add(const std::string& settings, const Series& series);
  // Draws the file. Writes the script (.gp) and the data (.dat) beside it, and keeps them. Returns
  // false if gnuplot fails or is not installed; the script also runs elsewhere. Throws
  // std::runtime_error if the script or the data cannot be written.
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
