#include "benchmarks/support/gnuplot.h"

#include <algorithm>
#include <cstdlib>

#include "common/base/result_file.h"

namespace fivepipe::bench {

void Plots::add(const std::string& settings, const Series& series) {
  text_ << settings;
  ++plots_;
  std::string sep = "plot ";
  for (const auto& [name, points] : series) {
    text_ << sep << '\'' << beside(".dat").filename().string() << "' index " << index_++
          << " with linespoints pt 7 title '" << name << '\'';
    sep = ", ";
    blocks_ << "# " << name << '\n';
    std::vector<PlotPoint> sorted = points;
    std::sort(sorted.begin(), sorted.end(),
              [](const PlotPoint& a, const PlotPoint& b) { return a.x < b.x; });
    for (const PlotPoint& p : sorted) blocks_ << p.x << ' ' << p.y << '\n';
    blocks_ << "\n\n";
  }
  if (series.empty())
    text_ << "set multiplot next\n";
  else
    text_ << '\n';
}

bool Plots::draw() const {
  const std::string size = plots_ == 1 ? "1000,700" : "1500,1000",
                    layout = plots_ == 1 ? "1,1" : "2,2";
  const std::string terminal = file_.extension() == ".svg"
                                   ? "svg size " + size + " background 'white'"
                                   : "pngcairo size " + size;
  base::write_file(beside(".dat"), blocks_.str());
  base::write_file(beside(".gp"), "set terminal " + terminal + "\nset output '" +
                                      file_.filename().string() +
                                      "'\nset grid\nset multiplot layout " + layout + "\n" +
                                      text_.str() + "unset multiplot\n");
  const std::filesystem::path folder = file_.has_parent_path() ? file_.parent_path() : ".";
  return std::system(("cd '" + folder.string() + "' && gnuplot '" +
                      beside(".gp").filename().string() + "' >/dev/null 2>&1")
                         .c_str()) == 0;
}

}  // namespace fivepipe::bench
