#include "benchmarks/collision/results_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/base/result_file.h"

namespace fivepipe::collision_bench {
namespace {

using nlohmann::ordered_json;

ordered_json or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json json_of(const Quantiles& q) {
  if (q.count == 0) return nullptr;
  return {{"median", q.median}, {"p95", q.p95}, {"worst", q.worst}, {"count", q.count}};
}

ordered_json json_of(const ResponseErrors& e) {
  return {{"cases", e.cases},
          {"no_exit", e.no_exit},
          {"cp_hull_error_mm", json_of(e.cp_hull_mm)},
          {"d_rec_error_mm", json_of(e.d_rec_mm)},
          {"n_hull_error_deg", json_of(e.n_hull_deg)}};
}

// The values are null if the method has no response, or its time is not measured separately. The
// normals' errors are null if the scene has no true silhouettes to compare with.
ordered_json json_of(const Result& r) {
  ordered_json json{{"name", r.name()},
                    {"time_ms", base::times_json(r.own_ms)},
                    {"maps_ms", base::times_json(r.maps_ms)},
                    {"build_ms", base::times_json(r.build_ms)},
                    {"query_ms", base::times_json(r.query_ms)},
                    {"total_ms", base::times_json(r.total_ms)},
                    {"refit_ms", or_null(r.refit_ms)},
                    {"response_ms", r.response_ms.empty() ? ordered_json(nullptr)
                                                          : base::times_json(r.response_ms)},
                    {"response", r.response ? json_of(*r.response) : ordered_json(nullptr)},
                    {"triangles_per_s", r.triangles_per_s()},
                    {"contacting_per_s", r.contacting_per_s()},
                    {"error",
                     {{"deepest_missed_mm", 1000 * r.wrong.deepest_missed_m},
                      {"deepest_missed_border_mm", 1000 * r.wrong.deepest_missed_border_m}}},
                    {"counts",
                     {{"cameras", r.cameras},
                      {"objects", r.objects},
                      {"triangles", r.truth.triangles},
                      {"near", r.truth.near},
                      {"crossing", r.truth.crossing},
                      {"crossing_border", r.truth.crossing_border},
                      {"colliding", r.colliding},
                      {"missed", r.wrong.missed},
                      {"missed_inside", r.wrong.missed_inside},
                      {"false", r.wrong.invented},
                      {"undecided", r.wrong.undecided},
                      {"points", r.points}}}};
  for (const auto& [name, value] : r.counts) json["counts"][name] = value;
  return json;
}

ordered_json json_of(const ProximityResult& r) {
  return {{"name", r.name()},
          {"time_ms", base::times_json(r.ms)},
          {"ms_per_1000", r.ms_per_1000()},
          {"error",
           {{"distance_median_mm", r.error_median_mm},
            {"distance_worst_mm", r.error_worst_mm},
            {"bounds_width_median_mm", or_null(r.width_median_mm)},
            {"bounds_width_widest_mm", or_null(r.width_widest_mm)}}},
          {"counts",
           {{"points", r.points},
            {"below_cap", r.below_cap},
            {"known", r.known},
            {"violations", r.violations}}}};
}

ordered_json json_of(const NormalsAt& at, const NormalCurve& curve) {
  const NormalError& e = at.*curve.error;
  return {{"name", fmt::format("normals/{}/{:g}px/1", curve.name, at.radius_px)},
          {"error", {{"n_hull_median_deg", e.median_deg}, {"n_hull_p95_deg", e.p95_deg}}},
          {"counts", {{"ways", at.queries}, {"given", e.given}}}};
}

ordered_json json_of(const CostFit& c) {
  return {{"ns_per_transform", c.ns_per_transform},
          {"ns_per_fill", c.ns_per_fill},
          {"ns_per_read", c.ns_per_read},
          {"ns_per_point", c.ns_per_point},
          {"fixed_ms", c.fixed_ms},
          {"median_off", c.median_off},
          {"worst_off", c.worst_off},
          {"measurements", c.measurements}};
}

ordered_json json_of(const ResponseFit& r) {
  return {{"fixed_ms", r.fixed_ms}, {"ns_per_unit", r.ns_per_unit}, {"worst_off", r.worst_off}};
}

ordered_json json_of(const AccuracyFit& fit) {
  ordered_json viewports = ordered_json::array();
  for (const AccuracyFit::Viewport& v : fit.viewports)
    viewports.push_back({{"px", v.px},
                         {"found_from", v.found_from},
                         {"widest_missed", v.widest_missed},
                         {"missed", v.missed},
                         {"found", v.found}});
  return {{"found_from", fit.found_from}, {"worst_off", fit.worst_off}, {"viewports", viewports}};
}

ordered_json json_of(const PaperModelFits& fits) {
  return {{"cost", json_of(fits.cost)},
          {"extended_cost", json_of(fits.extended_cost)},
          {"response_by_area", json_of(fits.response_by_area)},
          {"response_by_lines", json_of(fits.response_by_lines)},
          {"accuracy", json_of(fits.accuracy)}};
}

}  // namespace

void write_json(const std::filesystem::path& file, const AllResults& results,
                const std::string& gl_renderer) {
  ordered_json entries = ordered_json::array();
  for (const Result& r : results.detections) entries.push_back(json_of(r));
  for (const ProximityResult& r : results.proximities) entries.push_back(json_of(r));
  for (const NormalsAt& at : results.normals)
    for (const NormalCurve& curve : kNormalCurves) entries.push_back(json_of(at, curve));
  ordered_json suite = base::suite_json("collision", gl_renderer, entries);
  if (results.paper_model) suite["paper_laws"] = json_of(*results.paper_model);
  base::write_json(file, suite);
}

}  // namespace fivepipe::collision_bench
