#include "benchmarks/support/gnuplot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

#include "common/base/result_file.h"

namespace fivepipe::bench {

void Plots::add(const std::string& settings, const Series& series) {
  text_ << settings;
  ++plots_;
  std::vector<std::string> lines;
  for (const auto& [name, points] : series) {
    // gnuplot repeats its colours after eight series. The next eight have another symbol.
    const int symbol = lines.size() < 8 ? 7 : 9;  // a filled circle, a filled triangle
    lines.push_back(fmt::format("'{}' index {} with linespoints pt {} title '{}'",
                                beside(".dat").filename().string(), index_++, symbol, name));
    blocks_ << "# " << name << '\n';
    std::vector<PlotPoint> sorted = points;
    std::sort(sorted.begin(), sorted.end(),
              [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
    for (const PlotPoint& p : sorted) blocks_ << p.x << ' ' << p.y << '\n';
    blocks_ << "\n\n";
  }
  text_ << (series.empty() ? "set multiplot next" : fmt::format("plot {}", fmt::join(lines, ", ")))
        << '\n';
}

bool Plots::draw() const {
  const std::string size = plots_ == 1 ? "1000,700" : "1500,1000",
                    layout = plots_ == 1 ? "1,1" : "2,2";
  const std::string terminal = file_.extension() == ".svg"
                                   ? fmt::format("svg size {} background 'white'", size)
                                   : "pngcairo size " + size;
  base::write_file(beside(".dat"), blocks_.str());
  base::write_file(
      beside(".gp"),
      fmt::format("set terminal {}\nset output '{}'\nset grid\nset multiplot layout {}\n{}"
                  "unset multiplot\n",
                  terminal, file_.filename().string(), layout, text_.str()));
  const std::filesystem::path folder = file_.has_parent_path() ? file_.parent_path() : ".";
  return std::system(fmt::format("cd '{}' && gnuplot '{}' >/dev/null 2>&1", folder.string(),
                                 beside(".gp").filename().string())
                         .c_str()) == 0;
}

}  // namespace fivepipe::bench
