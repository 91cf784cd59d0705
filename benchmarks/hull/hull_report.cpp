#include "benchmarks/hull/hull_report.h"

#include <fmt/format.h>

#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"

namespace fivepipe::hull_bench {
namespace {

using base::percentile;
using base::with_decimals;
using nlohmann::ordered_json;

double median_ms(const Result& r) { return percentile(r.time_ms, 0.5); }

// Null: not measured. Footage has no true silhouettes, and those of many cameras take long.
ordered_json surface_mm(const Errors& e, double p) {
  return e.surface_mm.empty() ? ordered_json() : ordered_json(percentile(e.surface_mm, p));
}

ordered_json json_of(const Result& r) {
  const Errors& e = r.errors;
  ordered_json json = {{"name", r.name()},
                       {"time_ms", base::times_json(r.time_ms)},
                       {"error",
                        {{"depth_mean_mm", base::mean(e.depth_mm)},
                         {"depth_median_mm", percentile(e.depth_mm, 0.5)},
                         {"depth_p99_mm", percentile(e.depth_mm, 0.99)},
                         {"depth_p999_mm", percentile(e.depth_mm, 0.999)},
                         {"depth_max_mm", percentile(e.depth_mm, 1)},
                         {"depth_any_piece_p99_mm", percentile(e.all_mm, 0.99)},
                         {"other_depth_relative", e.other_depth},
                         {"surface_median_mm", surface_mm(e, 0.5)},
                         {"surface_p95_mm", surface_mm(e, 0.95)},
                         {"pixel_footprint_mm", r.footprint_mm}}},
                       {"counts",
                        {{"cameras", r.cameras},
                         {"map_width_px", r.map_width_px},
                         {"map_height_px", r.map_height_px},
                         {"hits", r.hits},
                         {"reference_rays", e.rays},
                         {"reference_hits", e.reference_hits},
                         {"wrong_hits", e.wrong_hits},
                         {"wrong_misses", e.wrong_misses},
                         {"wrong_pieces", e.wrong_pieces},
                         {"other_pixels", e.other_pixels},
                         {"maps_covered_percent", 100 * r.maps_covered}}},
                       {"checksum", fmt::format("{:x}", r.checksum)}};
  if (r.pixels) {
    json["error"]["every_pixel_depth_relative"] = r.pixels->max_depth_error;
    json["counts"]["every_pixel"] = r.pixels->pixels;
    json["counts"]["every_pixel_wrong"] = r.pixels->wrong;
  }
  return json;
}

struct Baseline {
  std::string prefix;  // of its methods' names
  bool only_fair;      // only settings with a mean error of at most kFairError_mm
};

// Returns the fastest setting of a baseline for the view and threads of `ours`, or nullptr.
const Result* fastest(const std::vector<Result>& results, const Baseline& baseline,
                      const Result& ours) {
  const Result* fastest = nullptr;
  for (const Result& r : results) {
    const bool of_baseline =
        baseline.prefix == "gl" ? r.method == "gl" : r.method.starts_with(baseline.prefix);
    if (!of_baseline || r.scene != ours.scene || r.width_px != ours.width_px ||
        r.threads != ours.threads)
      continue;
    if (baseline.only_fair && base::mean(r.errors.depth_mm) > kFairError_mm) continue;
    if (!fastest || median_ms(r) < median_ms(*fastest)) fastest = &r;
  }
  return fastest;
}

}  // namespace

std::string Result::name() const {
  return fmt::format("{}/{}/{}x{}/{}", method, scene, width_px, height_px, threads);
}

std::uint64_t checksum(std::span<const float> depths) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const float d : depths) {
    std::uint32_t bits;
    std::memcpy(&bits, &d, sizeof bits);
    for (int shift = 0; shift < 32; shift += 8)
      hash = (hash ^ (bits >> shift & 0xff)) * 0x100000001b3;
  }
  return hash;
}

void print(const std::vector<Result>& results) {
  base::TextTable table({{"method/scene/view/threads"},
                         {"ms best", true},
                         {"median", true},
                         {"p99", true},
                         {"runs", true},
                         {"mm mean", true},
                         {"median", true},
                         {"p99", true},
                         {"p99.9", true},
                         {"max", true},
                         {"+hit", true},
                         {"-hit", true},
                         {"-piece", true},
                         {"other", true},
                         {"surface", true},
                         {"footpr.", true}});
  for (const Result& r : results) {
    const Errors& e = r.errors;
    std::vector<std::string> cells{
        r.name(), with_decimals(percentile(r.time_ms, 0), 3), with_decimals(median_ms(r), 3),
        with_decimals(percentile(r.time_ms, 0.99), 3), std::to_string(r.time_ms.size())};
    cells.push_back(with_decimals(base::mean(e.depth_mm), 5));
    for (const double p : {0.5, 0.99, 0.999, 1.0})
      cells.push_back(with_decimals(percentile(e.depth_mm, p), 5));
    for (const int count : {e.wrong_hits, e.wrong_misses, e.wrong_pieces, e.other_pixels})
      cells.push_back(std::to_string(count));
    cells.push_back(e.surface_mm.empty() ? "-" : with_decimals(percentile(e.surface_mm, 0.5), 3));
    cells.push_back(with_decimals(r.footprint_mm, 3));
    table.add(std::move(cells));
  }
  std::cout << table.text()
            << "ms: everything from packed maps to depth.\n"
               "mm: depth error against the exact hull of the same maps; the reference intersects "
               "seeded rays.\n"
               "+hit, -hit: rays that wrongly hit or miss the hull.\n"
               "-piece: rays that pass through the hull's first piece and hit a later one; the mm "
               "columns omit them.\n"
               "other: pixels of the whole view whose verdict differs from backend cpu (exact "
               "methods only).\n"
               "surface: median error in mm against the hull of the true silhouettes (-: not "
               "measured); footpr.: "
               "width in mm of a map pixel at the object.\n";
}

void print_every_pixel(const std::vector<Result>& results) {
  std::vector<PixelRow> rows;
  for (const Result& r : results)
    if (r.pixels)
      rows.push_back({r.scene, fmt::format("{}, {} threads", r.method, r.threads), r.width_px,
                      r.height_px, *r.pixels});
  std::cout << '\n' << every_pixel_table(rows);
}

void print_ratios(const std::vector<Result>& results) {
  base::TextTable table({{"scene/view/threads"}, {"cpu ms", true}, {"time relative to cpu"}});
  for (const Result& ours : results) {
    if (ours.method != "cpu") continue;
    std::string ratios;
    for (const Baseline& baseline : {Baseline{"ibvh", false},
                                     {"cpusweep", true},
                                     {"plainsweep", true},
                                     {"carve", true},
                                     {"glsweep", true},
                                     {"gl", false}})
      if (const Result* r = fastest(results, baseline, ours))
        ratios += fmt::format("{}{} {:.2f}", ratios.empty() ? "" : "  ", r->method,
                              median_ms(*r) / median_ms(ours));
    if (!ratios.empty())
      table.add({ours.name().substr(4), with_decimals(median_ms(ours), 3), ratios});
  }
  std::cout << fmt::format(
      "\n{}Each baseline runs at its fastest setting with a mean error of at most {:g} mm; times "
      "are medians of all runs.\n",
      table.text(), kFairError_mm);
}

void write_json(const std::filesystem::path& file, const std::vector<Result>& results,
                const std::string& gl_renderer) {
  ordered_json entries = ordered_json::array();
  for (const Result& r : results) entries.push_back(json_of(r));
  base::write_json(file, base::suite_json("hull", gl_renderer, entries));
}

void write_every_pixel_json(const std::filesystem::path& file, const std::vector<PixelRow>& rows,
                            const std::string& gl_renderer) {
  ordered_json entries = ordered_json::array();
  for (const PixelRow& row : rows)
    entries.push_back(
        {{"name", fmt::format("{}/{}x{}/{}", row.scene, row.width_px, row.height_px, row.backend)},
         {"error", {{"max_depth_relative", row.errors.max_depth_error}}},
         {"counts",
          {{"pixels", row.errors.pixels},
           {"hits", row.errors.hits},
           {"wrong", row.errors.wrong}}}});
  base::write_json(file, base::suite_json("hull_every_pixel", gl_renderer, entries));
}

}  // namespace fivepipe::hull_bench
