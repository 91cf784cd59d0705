// Plots by gnuplot: the numbers as blocks in a data file, one line a series.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/hull/bench/report.h"

namespace fivepipe::bench {
namespace {

// Where an error is below this it is drawn there: a logarithm has no zero [mm].
constexpr double kLeastDrawn_mm = 1e-5;

struct Point {
  double x, y;
};
using Series = std::map<std::string, std::vector<Point>>;

std::string family(const std::string& method) {  // "cpusweepmid160" -> "cpusweepmid"
  return method.substr(0, method.find_first_of("0123456789"));
}

Series speed_against_error(const std::vector<Result>& results) {
  Series series;
  for (const Result& r : results)
    if (r.scene == "hand4-near" && r.width_px == 640)
      series[family(r.method) + ", " + std::to_string(r.threads) + (r.threads > 1 ? " threads" : " thread")].push_back({percentile(r.time_ms, 0), std::max(kLeastDrawn_mm, mean(r.errors.depth_mm))});
  return series;
}

// Series of one thread count of backend cpu and its nearest rival over what changes from scene to scene.
Series over(const std::vector<Result>& results, const std::function<double(const Result&)>& x, const std::function<bool(const Result&)>& wanted) {
  Series series;
  for (const Result& r : results)
    if (wanted(r) && (r.method == "cpu" || r.method == "ibvh")) series[r.method + ", " + std::to_string(r.threads)].push_back({x(r), percentile(r.time_ms, 0)});
  return series;
}

class Script {
 public:
  explicit Script(const std::filesystem::path& data) : data_(data) {}
  void add(const std::string& settings, const Series& series) {
    text_ << settings;
    std::string sep = "plot ";
    for (const auto& [name, points] : series) {
      text_ << sep << '\'' << data_.filename().string() << "' index " << index_++ << " with linespoints pt 7 title '" << name << '\'';
      sep = ", ";
      blocks_ << "# " << name << '\n';
      std::vector<Point> sorted = points;
      std::sort(sorted.begin(), sorted.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
      for (const Point& p : sorted) blocks_ << p.x << ' ' << p.y << '\n';
      blocks_ << "\n\n";
    }
    if (series.empty()) text_ << "set multiplot next\n";
    else text_ << '\n';
  }
  std::string text() const { return text_.str(); }
  std::string blocks() const { return blocks_.str(); }

 private:
  std::filesystem::path data_;
  std::ostringstream text_, blocks_;
  int index_ = 0;
};

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace

bool plot(const std::vector<Result>& results, const std::filesystem::path& file) {
  const auto beside = [&](const char* extension) { return std::filesystem::path(file).replace_extension(extension); };
  Script script(beside(".dat"));
  script.add("set title 'hand, maps 15 % covered, 640x480'; set xlabel 'ms (best)'; set ylabel 'mean depth error, mm (below 1e-5: at 1e-5)'; set logscale xy; set key outside right\n", speed_against_error(results));
  script.add("set title 'cost against cameras (720x486, 640x480)'; set xlabel 'cameras'; set ylabel 'ms (best)'\n",
             over(results, [](const Result& r) { return double(r.cameras); }, [](const Result& r) { return r.scene.starts_with("ring") && r.width_px == 640; }));
  script.add("set title 'cost against view size (hand4)'; set xlabel 'pixels of the view'; set ylabel 'ms (best)'\n",
             over(results, [](const Result& r) { return double(r.width_px) * r.height_px; }, [](const Result& r) { return r.scene == "hand4"; }));
  script.add("set title 'cost against coverage (640x480)'; set xlabel 'pixels of the view with hull'; set ylabel 'ms (best)'\n",
             over(results, [](const Result& r) { return double(r.hits); }, [](const Result& r) { return r.scene.starts_with("cover") && r.width_px == 640; }));
  const std::string terminal = file.extension() == ".svg" ? "svg size 1500,1000 background 'white'" : "pngcairo size 1500,1000";
  write(beside(".dat"), script.blocks());
  write(beside(".gp"), "set terminal " + terminal + "\nset output '" + file.filename().string() + "'\nset grid\nset multiplot layout 2,2\n" + script.text() + "unset multiplot\n");
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  return std::system(("cd '" + folder.string() + "' && gnuplot '" + beside(".gp").filename().string() + "' >/dev/null 2>&1").c_str()) == 0;
}

}  // namespace fivepipe::bench
