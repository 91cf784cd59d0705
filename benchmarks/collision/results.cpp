#include "benchmarks/collision/results.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "benchmarks/support/gnuplot.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"

namespace fivepipe::collision_bench {
namespace {

using base::percentile;
using base::quoted;
using base::times_json;

// Where nothing is missed it is drawn here: a logarithm has no zero [mm].
constexpr double kMinDrawn_mm = 0.01;

double best(const std::vector<double>& times) { return base::percentile(times, 0); }
double per_s(std::size_t count, const std::vector<double>& times_ms) {
  return best(times_ms) > 0 ? 1000 * double(count) / best(times_ms) : 0;
}

std::string or_null(const std::optional<double>& value) {
  if (!value) return "null";
  std::ostringstream out;
  out << *value;
  return out.str();
}
std::string json_of(const Quantiles& q) {
  if (q.count == 0) return "null";
  std::ostringstream out;
  out << "{\"median\": " << q.median << ", \"p95\": " << q.p95 << ", \"worst\": " << q.worst
      << ", \"count\": " << q.count << "}";
  return out.str();
}
// Nulls where the method has no response, or its time was not taken, or the scene has no true
// silhouettes to hold normals against.
std::string response_json(const Result& r) {
  std::ostringstream out;
  out << "\"refit_ms\": " << or_null(r.refit_ms)
      << ", \"response_ms\": " << (r.response_ms.empty() ? "null" : base::times_json(r.response_ms))
      << ", \"response\": ";
  if (!r.response) return out.str() + "null";
  const ResponseErrors& e = *r.response;
  out << "{\"cases\": " << e.cases << ", \"no_way\": " << e.no_exit
      << ", \"cp_hull_error_mm\": " << json_of(e.cp_hull_mm)
      << ", \"d_rec_error_mm\": " << json_of(e.d_rec_mm)
      << ", \"n_hull_error_deg\": " << json_of(e.n_hull_deg) << "}";
  return out.str();
}

// "-" for what is not there.
std::string cell(const std::optional<double>& value, const char* format = "%.4f") {
  if (!value) return "-";
  char text[32];
  std::snprintf(text, sizeof text, format, *value);
  return text;
}

}  // namespace

std::string Result::name() const {
  return method + "/" + scene + "/" + setting + "/" + std::to_string(threads);
}
double Result::triangles_per_s() const { return per_s(truth.triangles, own_ms); }
double Result::contacting_per_s() const { return per_s(truth.crossing, own_ms); }

void print(const std::vector<Result>& results) {
  std::printf(
      "%-30s %9s %9s %9s %4s | %8s %9s | %9s %9s | %8s %8s %8s %7s %7s %8s %8s %6s %6s %8s\n",
      "method/scene/setting/threads", "ms best", "median", "p99", "runs", "maps ms", "total ms",
      "ktri/s", "contact", "tri", "crossing", "collide", "missed", "inside", "deepest", "border",
      "false", "touch", "points");
  for (const Result& r : results)
    std::printf(
        "%-30s %9.3f %9.3f %9.3f %4zu | %8.3f %9.3f | %9.1f %9.2f | %8zu %8zu %8zu %7zu %7zu %8.3f "
        "%8.3f %6zu %6zu %8zu\n",
        r.name().c_str(), best(r.own_ms), base::percentile(r.own_ms, 0.5),
        base::percentile(r.own_ms, 0.99), r.own_ms.size(), base::percentile(r.maps_ms, 0.5),
        base::percentile(r.total_ms, 0.5), 1e-3 * r.triangles_per_s(), 1e-3 * r.contacting_per_s(),
        r.truth.triangles, r.truth.crossing, r.colliding, r.wrong.missed, r.wrong.missed_inside,
        1000 * r.wrong.deepest_missed_m, 1000 * r.wrong.deepest_missed_border_m, r.wrong.invented,
        r.wrong.undecided, r.points);
  std::puts(
      "ms: the method's own time, without the response and beyond the maps' preparation (its "
      "median beside; both are in the total's median); ktri/s: thousands of triangles a second by "
      "the best own time,\n"
      "contact: of those alone that truly collide; crossing: triangles with a point in the hull, "
      "by truth; collide: said to; missed: crossing, and called free; inside: of those,\n"
      "the ones wholly in the hull; deepest: the deepest point of those missed below the hull's "
      "border [mm], by a lower bound; border: of those missed that cross the border;\n"
      "false: said to collide, truth says no, and no point of theirs is in the hull; touch: "
      "neither said.");
}

void print_responses(const std::vector<Result>& results) {
  std::printf("\n%-30s %9s %9s %9s %9s %9s | %5s %6s | %9s %9s | %9s %9s | %6s %8s %8s\n",
              "method/scene/setting/threads", "build ms", "refit", "detect", "response", "all",
              "cases", "no way", "CP median", "worst", "D median", "worst", "N of", "median",
              "p95");
  for (const Result& r : results) {
    if (!r.response) continue;
    const double build_ms = best(r.build_ms), query_ms = best(r.query_ms);
    std::optional<double> response_ms, all_ms;
    if (!r.response_ms.empty())
      response_ms = best(r.response_ms), all_ms = best(r.own_ms) + best(r.response_ms);
    const ResponseErrors& e = *r.response;
    const auto of = [](const Quantiles& q, double Quantiles::*member) {
      return q.count ? std::optional(q.*member) : std::nullopt;
    };
    std::printf("%-30s %9.4f %9s %9.4f %9s %9s | %5zu %6zu | %9s %9s | %9s %9s | %6zu %8s %8s\n",
                r.name().c_str(), build_ms, cell(r.refit_ms).c_str(),
                query_ms - r.refit_ms.value_or(0), cell(response_ms).c_str(), cell(all_ms).c_str(),
                e.cases, e.no_exit, cell(of(e.cp_hull_mm, &Quantiles::median), "%.2g").c_str(),
                cell(of(e.cp_hull_mm, &Quantiles::worst), "%.2g").c_str(),
                cell(of(e.d_rec_mm, &Quantiles::median), "%.2g").c_str(),
                cell(of(e.d_rec_mm, &Quantiles::worst), "%.2g").c_str(), e.n_hull_deg.count,
                cell(of(e.n_hull_deg, &Quantiles::median), "%.2f").c_str(),
                cell(of(e.n_hull_deg, &Quantiles::p95), "%.2f").c_str());
  }
  std::puts(
      "best ms, one frame beyond the maps' preparation: what the method builds of the maps; trees "
      "of deformed objects refitted; verdicts and CP_i; response of every object that\n"
      "collides, without asking again after the move; all: their sum. Then errors of the response "
      "for the same CP_obj and V_rec: CP_hull and D_rec [mm] against the exact reference,\n"
      "N_hull [degrees] against the hull of the true silhouettes, where the same camera's ends "
      "both near CP_hull (N of: so many). no way: none found where there is one. -: not told "
      "apart, or none.");
}

void print_ratios(const std::vector<Result>& results) {
  std::printf("\n%-30s | %14s %14s\n", "method/scene/setting/threads", "x paper10 here",
              "x paper's own");
  for (const Result& r : results) {
    const auto paper = std::find_if(results.begin(), results.end(), [&](const Result& p) {
      return p.method == "paper10" && p.scene == r.scene;
    });
    char ratio[32] = "-";
    if (paper != results.end())
      std::snprintf(ratio, sizeof ratio, "%.1f", r.triangles_per_s() / paper->triangles_per_s());
    std::printf("%-30s | %14s %14.1f\n", r.name().c_str(), ratio,
                r.triangles_per_s() / kPaperTriangles_per_s);
  }
  std::puts(
      "triangles a second, beside the paper's backend in this run (on all threads) and beside the "
      "paper's 4,320 a second on its machine (13,000 with its three cameras counted).");
}

std::string json_of(const Result& r) {
  std::ostringstream out;
  out << "  {\"name\": " << base::quoted(r.name())
      << ", \"time_ms\": " << base::times_json(r.own_ms)
      << ",\n   \"maps_ms\": " << base::times_json(r.maps_ms)
      << ", \"build_ms\": " << base::times_json(r.build_ms)
      << ", \"query_ms\": " << base::times_json(r.query_ms)
      << ", \"total_ms\": " << base::times_json(r.total_ms) << ",\n   " << response_json(r)
      << ",\n   \"triangles_per_s\": " << r.triangles_per_s()
      << ", \"contacting_per_s\": " << r.contacting_per_s()
      << ", \"error\": {\"deepest_missed_mm\": " << 1000 * r.wrong.deepest_missed_m
      << ", \"deepest_missed_border_mm\": " << 1000 * r.wrong.deepest_missed_border_m
      << "},\n   \"counts\": {\"cameras\": " << r.cameras << ", \"objects\": " << r.objects
      << ", \"triangles\": " << r.truth.triangles << ", \"known\": " << r.truth.known
      << ", \"near\": " << r.truth.near << ", \"crossing\": " << r.truth.crossing
      << ", \"crossing_border\": " << r.truth.crossing_border << ", \"colliding\": " << r.colliding
      << ", \"missed\": " << r.wrong.missed << ", \"missed_inside\": " << r.wrong.missed_inside
      << ", \"false\": " << r.wrong.invented << ", \"touching\": " << r.wrong.undecided
      << ", \"points\": " << r.points;
  for (const auto& [name, value] : r.counts) out << ", " << base::quoted(name) << ": " << value;
  out << "}}";
  return out.str();
}

// Drawn on one thread alone: as many series as there are colours.
bool runs_on_one_thread(const std::string& method) {
  return method.starts_with("cpu") || method.starts_with("brute") || method.starts_with("fcl");
}

bool plot(const std::vector<Result>& results, const std::filesystem::path& file) {
  bench::Plots plots(file);
  for (const char* scene : {"curtain720", "payload", "thin", "real"}) {
    bench::Series series;
    for (const Result& r : results)
      if (r.scene == scene && (r.threads == 1 || !runs_on_one_thread(r.method)))
        series[r.method.substr(0, r.method.find_first_of("0123456789")) + ", " +
               std::to_string(r.threads)]
            .push_back(
                {best(r.own_ms), std::max(kMinDrawn_mm, 1000 * r.wrong.deepest_missed_border_m)});
    plots.add(std::string("set title '") + scene +
                  "'; set xlabel 'ms (best, beyond the maps)'; set ylabel 'deepest missed across "
                  "the border, mm (none: 0.01)'; set logscale xy; set yrange [0.008:]; set key "
                  "outside right\n",
              series);
  }
  return plots.draw();
}

}  // namespace fivepipe::collision_bench
