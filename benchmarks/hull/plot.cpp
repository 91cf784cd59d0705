#include <algorithm>
#include <functional>

#include "benchmarks/hull/hull_report.h"
#include "benchmarks/support/gnuplot.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"

namespace fivepipe::hull_bench {
namespace {

// Plots draw smaller errors at this value, because a logarithm has no zero.
constexpr double kMinDrawn_mm = 1e-5;

std::string family(const std::string& method) {  // "cpusweepmid160" -> "cpusweepmid"
  return method.substr(0, method.find_first_of("0123456789"));
}

bench::Series speed_against_error(const std::vector<Result>& results) {
  bench::Series series;
  for (const Result& r : results)
    if (r.scene == "hand4-near" && r.width_px == 640)
      series[family(r.method) + ", " + base::counted(std::uint64_t(r.threads), "thread")].push_back(
          {base::percentile(r.time_ms, 0.5),
           std::max(kMinDrawn_mm, base::mean(r.errors.depth_mm))});
  return series;
}

// Median time of backend cpu and of its fastest baseline over x, one series per number of threads.
bench::Series time_over(const std::vector<Result>& results,
                        const std::function<double(const Result&)>& x,
                        const std::function<bool(const Result&)>& selected) {
  bench::Series series;
  for (const Result& r : results)
    if (selected(r) && (r.method == "cpu" || r.method == "ibvh"))
      series[r.method + ", " + std::to_string(r.threads)].push_back(
          {x(r), base::percentile(r.time_ms, 0.5)});
  return series;
}

}  // namespace

bool plot(const std::vector<Result>& results, const std::filesystem::path& file) {
  bench::Plots plots(file);
  plots.add(
      "set title 'hand, maps 15 % covered, 640x480'; set xlabel 'ms (median)'; set ylabel 'mean "
      "depth error, mm (below 1e-5: at 1e-5)'; set logscale xy; set key outside right\n",
      speed_against_error(results));
  plots.add(
      "set title 'time against the number of cameras (maps 720x486, view 640x480)'; set xlabel "
      "'cameras'; set ylabel 'ms "
      "(median)'\n",
      time_over(
          results, [](const Result& r) { return double(r.cameras); },
          [](const Result& r) { return r.scene.starts_with("ring") && r.width_px == 640; }));
  plots.add(
      "set title 'time against view size (hand4)'; set xlabel 'pixels of the view'; set ylabel 'ms "
      "(median)'\n",
      time_over(
          results, [](const Result& r) { return double(r.width_px) * r.height_px; },
          [](const Result& r) { return r.scene == "hand4"; }));
  plots.add(
      "set title 'time against coverage (view 640x480)'; set xlabel 'pixels of the view with "
      "hull'; set "
      "ylabel 'ms (median)'\n",
      time_over(
          results, [](const Result& r) { return double(r.hits); },
          [](const Result& r) { return r.scene.starts_with("cover") && r.width_px == 640; }));
  return plots.draw();
}

}  // namespace fivepipe::hull_bench
