// fivepipe bench render: the time in which the parent pipe draws and reads back a frame at the
// paper's sizes, with the errors of what it draws.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/render/errors/published_latency.h"
#include "benchmarks/render/suite_errors.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/gl/context.h"

namespace fivepipe::render_bench {
namespace {

struct Result {
  std::string name;  // "coloured"
  DrawingTimes times;
  QueryTimes queries;
  DrawingErrors errors;
};

Result measured(const config::Deployment& plain, const Variant& variant, SuiteErrors& errors,
                const bench::Args& args) {
  const config::Deployment deployment = with(plain, variant);
  Result result{variant.name, {}, {}, {}};
  std::vector<Frame> frames;
  for (int f = 0; f < kFrames; ++f)
    frames.push_back(frame_of(deployment, f, variant.coloured, result.queries));
  result.times = measured_times(deployment, frames, args.quick ? 1 : 5);
  result.errors = errors.of(variant, frames);
  return result;
}

void print(const std::vector<Result>& results) {
  base::TextTable table({{"ms"},
                         {"draw", true},
                         {"read", true},
                         {"both", true},
                         {"p95", true},
                         {"p99", true},
                         {"cpu", true},
                         {"error"}});
  const auto ms = [](const std::vector<double>& values, double p) {
    return base::with_decimals(base::percentile(values, p), 2);
  };
  for (const auto& [name, times, queries, errors] : results)
    table.add({name, ms(times.draw_ms, 0.5), ms(times.read_ms, 0.5), ms(times.frame_ms, 0.5),
               ms(times.frame_ms, 0.95), ms(times.frame_ms, 0.99), ms(times.cpu_ms, 0.5),
               errors.text});
  std::cout << table.text();
  for (const Result& result : results)
    if (!result.queries.light_ms.empty()) {
      std::cout << fmt::format(
          "hull query, one thread: {:.2f} ms for the viewer, {:.2f} ms more for the light\n",
          base::percentile(result.queries.viewer_ms, 0.5),
          base::percentile(result.queries.light_ms, 0.5));
      break;
    }
  for (const Result& result : results)
    for (const DrawingErrors::Registration& registration : result.errors.registrations)
      std::cout << '\n' << registration_text(registration);
}

nlohmann::ordered_json json_of(const Result& result, int threads) {
  const DrawingTimes& times = result.times;
  nlohmann::ordered_json json = {{"name", fmt::format("render/{}/{}", result.name, threads)},
                                 {"time_ms", base::times_json(times.frame_ms)},
                                 {"draw_ms", base::times_json(times.draw_ms)},
                                 {"read_back_ms", base::times_json(times.read_ms)},
                                 {"cpu_ms", base::times_json(times.cpu_ms)},
                                 {"error", result.errors.error},
                                 {"checksum", fmt::format("{:x}", times.checksum)}};
  if (!result.queries.light_ms.empty()) {
    json["viewer_query_ms"] = base::times_json(result.queries.viewer_ms);
    json["light_query_ms"] = base::times_json(result.queries.light_ms);
  }
  return json;
}

constexpr bench::Suite kSuite{
    .name = "render",
    .description =
        "Measures how long the parent pipe draws and reads back a frame of deployment paper: with "
        "a coloured hull and with a grey one; with shadows of virtual objects and of the hull; "
        "with light on the hull; with both; and with 10,000 particles.\n\n"
        "Errors beside the times:\n"
        "  wrong surface  pixels of the image that show another surface (hull, object, particle or "
        "background) than exact ray casts and the exact hull give; by drawing: than they give for "
        "the hull in the reconstruction's pixels\n"
        "  colour         absolute difference of the channels between the avatar and a render of "
        "the true object from the viewer's eye, in levels of 255, without light; at pixels where "
        "both show the object and a colour camera sees its surface; median and p95\n"
        "  shadow edges   of a plate's shadow on a wall, in a scene and a light's view of their "
        "own: area between drawn and analytic edge, divided by the edge's length; worst: farthest "
        "wrong pixel\n"
        "  registration   lateral distance in the view, at the object's depth, between the drawn "
        "avatar and the true object when the frame is composited: of outlines (each point to the "
        "other outline, in both directions) and of centroids. Each row adds a cause: renderer "
        "(draws the true object's depth), hull (of exact silhouettes), map (segmented images: "
        "registration at rest), latency (the object moves on at 1 m/s). 'adds' is the distance to "
        "the outline of the row above, for latency that between the object's own outlines. Once "
        "with the cameras of deployment paper, once with the six of deployment particles.",
    .example = "fivepipe bench render --json out/render.json",
    .only_help = "only results whose name contains this text, such as shadows",
    .latency_help =
        "latency from capture to composite [ms] in which the object moves; default: the published "
        "median of deployment paper, docs/benchmarks/paper_tiles.json, which segments its images "
        "before the start"};

void run(const bench::Args& args) {
  const std::string root = FIVEPIPE_SOURCE_DIR;
  const config::Deployment deployment =
      config::load_deployment(root + "/launch/deployments/paper.yaml");
  const double latency_ms = args.latency_ms
                                ? *args.latency_ms
                                : published_latency_ms(root + "/docs/benchmarks/paper_tiles.json");
  const gl::GlContext gl;
  std::cout << base::machine_line(gl.renderer()) << std::endl;
  SuiteErrors errors(deployment,
                     config::load_deployment(root + "/launch/deployments/particles.yaml"),
                     latency_ms, args.quick);
  std::vector<Result> results;
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  for (const Variant& variant :
       {Variant{.name = "coloured"}, Variant{.name = "grey", .coloured = false},
        Variant{.name = "shadows", .shadows = true}, Variant{.name = "lit", .lit = true},
        Variant{.name = "lit_shadows", .lit = true, .shadows = true},
        Variant{.name = "particles", .particles = true}}) {
    if (variant.name.find(args.only) == std::string::npos) continue;
    results.push_back(measured(deployment, variant, errors, args));
    entries.push_back(json_of(results.back(), args.threads));
  }
  print(results);
  if (!args.json_file.empty())
    base::write_json(args.json_file, base::suite_json("render", gl.renderer(), entries));
}

}  // namespace
}  // namespace fivepipe::render_bench

int main(int argc, char** argv) {
  return fivepipe::bench::run_suite(fivepipe::render_bench::kSuite, argc, argv,
                                    fivepipe::render_bench::run);
}
