#include "benchmarks/collision/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "benchmarks/support/gnuplot.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"

namespace fivepipe::collision_bench {
namespace {

using base::percentile;
using base::with_decimals;

// Plots draw a method that misses nothing at this depth, because a logarithm has no zero.
constexpr double kMinDrawn_mm = 0.01;

double median_ms(const std::vector<double>& time_ms) { return percentile(time_ms, 0.5); }
double per_s(std::size_t count, const std::vector<double>& time_ms) {
  return median_ms(time_ms) > 0 ? 1000 * double(count) / median_ms(time_ms) : 0;
}

std::string or_dash(const std::optional<double>& value_ms) {
  return value_ms ? with_decimals(*value_ms, 4) : "-";
}
std::string length_cell(const Quantiles& q, double Quantiles::*member) {
  return q.count ? fmt::format("{:.2g}", q.*member) : "-";
}
std::string angle_cell(const Quantiles& q, double Quantiles::*member) {
  return q.count ? with_decimals(q.*member, 2) : "-";
}

// The methods that also run on one thread. Plots show only that run, to limit the number of series.
bool runs_on_one_thread(const std::string& method) {
  return method.starts_with("cpu") || method.starts_with("brute") || method.starts_with("fcl");
}

}  // namespace

std::string Result::name() const {
  return fmt::format("{}/{}/{}/{}", method, scene, setting, threads);
}
double Result::triangles_per_s() const { return per_s(truth.triangles, own_ms); }
double Result::contacting_per_s() const { return per_s(truth.crossing, own_ms); }

void print(const std::vector<Result>& results) {
  base::TextTable table({{"method/scene/setting/threads"},
                         {"ms best", true},
                         {"median", true},
                         {"p99", true},
                         {"runs", true},
                         {"maps ms", true},
                         {"total ms", true},
                         {"ktri/s", true},
                         {"contact", true},
                         {"tri", true},
                         {"crossing", true},
                         {"collide", true},
                         {"missed", true},
                         {"inside", true},
                         {"deepest", true},
                         {"border", true},
                         {"false", true},
                         {"undecided", true},
                         {"points", true}});
  for (const Result& r : results) {
    std::vector<std::string> cells{r.name()};
    for (const double p : {0.0, 0.5, 0.99})
      cells.push_back(with_decimals(percentile(r.own_ms, p), 3));
    cells.push_back(std::to_string(r.own_ms.size()));
    cells.push_back(with_decimals(percentile(r.maps_ms, 0.5), 3));
    cells.push_back(with_decimals(percentile(r.total_ms, 0.5), 3));
    cells.push_back(with_decimals(1e-3 * r.triangles_per_s(), 1));
    cells.push_back(with_decimals(1e-3 * r.contacting_per_s(), 2));
    for (const std::size_t count :
         {r.truth.triangles, r.truth.crossing, r.colliding, r.wrong.missed, r.wrong.missed_inside})
      cells.push_back(std::to_string(count));
    cells.push_back(with_decimals(1000 * r.wrong.deepest_missed_m, 3));
    cells.push_back(with_decimals(1000 * r.wrong.deepest_missed_border_m, 3));
    for (const std::size_t count : {r.wrong.invented, r.wrong.undecided, r.points})
      cells.push_back(std::to_string(count));
    table.add(std::move(cells));
  }
  std::cout << table.text()
            << "ms: the method's own time, without the maps' preparation and the response. maps "
               "ms, total ms: medians; the total includes both.\n"
               "ktri/s: thousands of triangles per second, by the median own time; contact: only "
               "the triangles that truly cross the hull.\n"
               "crossing: triangles with a point in the hull, by the exact reference; collide: "
               "triangles that the method returns as colliding.\n"
               "missed: crossing triangles that the method calls free; inside: those of them that "
               "are wholly in the hull.\n"
               "deepest: the deepest point of a missed triangle below the hull's border in mm (a "
               "lower bound); border: only missed triangles that cross the border.\n"
               "false: triangles that the method calls colliding and that do not cross the hull; "
               "undecided: triangles that it calls neither free nor colliding.\n"
               "The exact reference determines every triangle of every scene, without any of these "
               "methods.\n";
}

void print_responses(const std::vector<Result>& results) {
  base::TextTable table({{"method/scene/setting/threads"},
                         {"build ms", true},
                         {"refit", true},
                         {"detect", true},
                         {"response", true},
                         {"all", true},
                         {"cases", true},
                         {"no exit", true},
                         {"CP median", true},
                         {"worst", true},
                         {"D median", true},
                         {"worst", true},
                         {"N cases", true},
                         {"N median", true},
                         {"p95", true}});
  for (const Result& r : results) {
    if (!r.response) continue;
    std::optional<double> response_ms, all_ms;
    if (!r.response_ms.empty()) {
      response_ms = median_ms(r.response_ms);
      all_ms = median_ms(r.own_ms) + median_ms(r.response_ms);
    }
    const ResponseErrors& e = *r.response;
    table.add(
        {r.name(), with_decimals(median_ms(r.build_ms), 4), or_dash(r.refit_ms),
         with_decimals(median_ms(r.query_ms) - r.refit_ms.value_or(0), 4), or_dash(response_ms),
         or_dash(all_ms), std::to_string(e.cases), std::to_string(e.no_exit),
         length_cell(e.cp_hull_mm, &Quantiles::median),
         length_cell(e.cp_hull_mm, &Quantiles::worst), length_cell(e.d_rec_mm, &Quantiles::median),
         length_cell(e.d_rec_mm, &Quantiles::worst), std::to_string(e.n_hull_deg.count),
         angle_cell(e.n_hull_deg, &Quantiles::median), angle_cell(e.n_hull_deg, &Quantiles::p95)});
  }
  std::cout << '\n'
            << table.text()
            << "ms: median times of one frame, after the maps' preparation. build: what the method "
               "builds from the maps; refit: BVHs of deformed objects;\n"
               "detect: verdicts and CP_i; response: of every colliding object, without the query "
               "after the move; all: their sum.\n"
               "CP, D: errors of CP_hull and D_rec in mm against the exact reference. N: error of "
               "N_hull in degrees against the hull of the true\n"
               "silhouettes, for the cases where the same camera limits both hulls near CP_hull. "
               "no exit: cases for which the method finds no exit.\n"
               "-: not measured separately, or none.\n";
}

void print_ratios(const std::vector<Result>& results) {
  base::TextTable table(
      {{"method/scene/setting/threads"}, {"x paper10 here", true}, {"x paper's own", true}});
  for (const Result& r : results) {
    const auto paper = std::find_if(results.begin(), results.end(), [&](const Result& p) {
      return p.method == "paper10" && p.scene == r.scene;
    });
    table.add({r.name(),
               paper == results.end()
                   ? "-"
                   : with_decimals(r.triangles_per_s() / paper->triangles_per_s(), 1),
               with_decimals(r.triangles_per_s() / kPaperTriangles_per_s, 1)});
  }
  std::cout << '\n'
            << table.text()
            << "Triangles per second by the median own time, without the maps' preparation, "
               "relative to the paper's backend in this\n"
               "run (on the largest number of threads) and to the paper's 4,320 per second on its "
               "machine, with collision points (13,000\n"
               "counted once per camera).\n";
}

bool plot(const std::vector<Result>& results, const std::filesystem::path& file) {
  bench::Plots plots(file);
  for (const char* scene : {"curtain720", "payload", "thin", "real"}) {
    bench::Series series;
    for (const Result& r : results)
      if (r.scene == scene && (r.threads == 1 || !runs_on_one_thread(r.method)))
        series[fmt::format("{}, {}", r.method.substr(0, r.method.find_first_of("0123456789")),
                           r.threads)]
            .push_back(
                {median_ms(r.own_ms), std::max(kMinDrawn_mm, 1000 * r.wrong.deepest_missed_m)});
    plots.add(fmt::format("set title '{}'; set xlabel 'ms (median, without the maps)'; set ylabel "
                          "'deepest missed, mm (none: 0.01)'; set logscale xy; "
                          "set yrange [0.008:]; set key outside right\n",
                          scene),
              series);
  }
  return plots.draw();
}

}  // namespace fivepipe::collision_bench
