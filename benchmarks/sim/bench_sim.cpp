// fivepipe bench sim: the time of a step of the simulation, with its errors: rigid bodies that fall
// on a real block, cloth that a real arm moves, and particles that it sweeps.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/sim/particle_rain.h"
#include "benchmarks/sim/sim_run.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/geometry/oriented_box.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::sim_bench {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// The silhouettes of a real block, 60 cm wide, whose top is at z = 0.
std::vector<hull::Silhouette> block_silhouettes() {
  const geometry::OrientedBox block{Isometry3d(Eigen::Translation3d(0, 0, -0.1)), {0.3, 0.3, 0.1}};
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras_at(5, 0))
    silhouettes.push_back({camera, hull::true_object_pixels(block, camera)});
  return silhouettes;
}

constexpr double kEdge_m = 0.04;

// Boxes in layers of 10 x 10, a little above the block and above each other.
config::Scene boxes(int count) {
  constexpr int kRow = 10;
  constexpr double kPitch_m = 0.055, kLayer_m = 0.045;
  config::Scene scene;
  scene.name = "boxes";
  for (int i = 0; i < count; ++i) {
    const int layer = i / (kRow * kRow), row = i / kRow % kRow, column = i % kRow;
    config::SceneObject box;
    box.name = fmt::format("box_{}", i);
    box.shape = config::BoxShape{Vector3d::Constant(kEdge_m)};
    box.world_from_object.translation() << (column - 4.5) * kPitch_m, (row - 4.5) * kPitch_m,
        0.5 * kEdge_m + 0.01 + layer * kLayer_m;
    box.motion = config::Motion::dynamic;
    box.reaction = config::Reaction::contact;
    box.mass_kg = 0.1;
    box.restitution = 0.1;
    scene.objects.push_back(box);
  }
  return scene;
}

// Depth of the box's lowest corner below the block's top [m].
double depth_m(const Isometry3d& world_from_box) {
  const double half_m = 0.5 * kEdge_m * world_from_box.linear().row(2).cwiseAbs().sum();
  return half_m - world_from_box.translation().z();
}

Result fallen_boxes(int count, const bench::Args& args) {
  const auto silhouettes = block_silhouettes();
  sim::Simulation simulation(boxes(count), {.threads = args.threads});
  Result result;
  result.name = fmt::format("bodies/{}", count);
  const int frames = args.quick ? 45 : 120, rest = frames - (args.quick ? 10 : 30);
  std::vector<Vector3d> placed_m;
  double jitter_m = 0, deepest_m = 0;
  for (int frame = 0; frame <= frames; ++frame) {
    advance(simulation, frame, silhouettes, result);
    const std::vector<sim::ObjectState> states = simulation.states();
    for (std::size_t i = 0; i < states.size(); ++i) {
      const Vector3d place_m = states[i].world_from_object.translation();
      if (frame == rest) placed_m.push_back(place_m);
      if (frame < rest) continue;
      jitter_m = std::max(jitter_m, (place_m - placed_m[i]).norm());
      deepest_m = std::max(deepest_m, depth_m(states[i].world_from_object));
    }
  }
  const sim::SimulationCounters counters = simulation.counters();
  result.error = {{"deepest_mm", 1e3 * deepest_m}, {"moved_at_rest_mm", 1e3 * jitter_m}};
  result.counts = {{"contacts", counters.contacts}, {"unrecovered", counters.unrecovered}};
  result.errors =
      fmt::format("{:.2f} mm deep at rest, moved by {:.2f} mm", 1e3 * deepest_m, 1e3 * jitter_m);
  return result;
}

// A curtain of 64 x 66 cm at y = 0, whose upper edge is fixed.
config::Scene curtain(int columns, int rows) {
  config::SceneObject cloth;
  cloth.name = "curtain";
  cloth.shape = config::CurtainShape{0.64, 0.66, columns, rows, 0.012, 4};
  cloth.world_from_object.translation() << 0, 0, 0.35;
  cloth.motion = config::Motion::cloth;
  cloth.reaction = config::Reaction::yield;
  cloth.cloth.emplace();
  cloth.cloth->v_rec_world = Vector3d::UnitY();
  cloth.cloth->pins.push_back({{Vector3d(-1, -1, -0.001), Vector3d(1, 1, 0.001)}});
  config::Scene scene;
  scene.name = "curtain";
  scene.objects.push_back(cloth);
  return scene;
}

// An arm that pushes into the curtain at 0.3 m/s and stops 12 cm behind it.
std::vector<hull::Silhouette> arm_silhouettes(double time_s,
                                              const std::vector<geometry::Camera>& cameras) {
  const double y_m = std::min(-0.1 + 0.3 * time_s, 0.12);
  const hull::Capsule arm{{0.03, y_m - 0.3, 0}, {0.03, y_m - 0.04, 0}, 0.04};
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras)
    silhouettes.push_back(
        {camera, hull::true_object_pixels({&arm, 1}, camera, hull::PixelRule::touched)});
  return silhouettes;
}

std::vector<Vector3d> pushed_curtain(int columns, int rows, double step_s, int threads, int frames,
                                     Result& result, sim::SimulationCounters& counters) {
  const auto cameras = cameras_at(4, 0.1);
  sim::Simulation simulation(curtain(columns, rows), {.threads = threads, .step_s = step_s});
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame <= frames; ++frame) {
    silhouettes = arm_silhouettes(frame * kFrame_s, cameras);
    advance(simulation, frame, silhouettes, result);
  }
  counters = simulation.counters();
  return simulation.states()[0].vertices_m;
}

// The error is the distance from the curtain of a run with steps 16 times smaller.
Result moved_curtain(int columns, int rows, bool with_reference, const bench::Args& args) {
  Result result;
  result.name = fmt::format("cloth/{}", 2 * columns * rows);
  const int frames = args.quick ? 15 : 60;
  sim::SimulationCounters counters, ignored_counters;
  const std::vector<Vector3d> vertices_m =
      pushed_curtain(columns, rows, kStep_s, args.threads, frames, result, counters);
  result.counts = {{"contacts", counters.cloth.contacts},
                   {"still_colliding", counters.cloth.still_colliding},
                   {"reset", counters.cloth.reset}};
  result.errors = fmt::format("{} frames end in the hull", counters.cloth.still_colliding);
  if (!with_reference) return result;
  Result ignored;
  const std::vector<Vector3d> reference_m =
      pushed_curtain(columns, rows, kStep_s / 16, args.threads, frames, ignored, ignored_counters);
  std::vector<double> off_mm;
  for (std::size_t i = 0; i < vertices_m.size(); ++i)
    off_mm.push_back(1e3 * (vertices_m[i] - reference_m[i]).norm());
  result.error = {{"median_mm", base::percentile(off_mm, 0.5)},
                  {"p95_mm", base::percentile(off_mm, 0.95)}};
  result.errors += fmt::format("; {:.1f} mm from steps of 1/16 (p95 {:.1f})",
                               base::percentile(off_mm, 0.5), base::percentile(off_mm, 0.95));
  return result;
}

nlohmann::ordered_json json_of(const Result& result, int threads) {
  nlohmann::ordered_json json = {{"name", fmt::format("sim/{}/{}", result.name, threads)},
                                 {"time_ms", base::times_json(result.step_ms)},
                                 {"frame_ms", base::times_json(result.frame_ms)}};
  if (!result.error.is_null()) json["error"] = result.error;
  json["counts"] = result.counts;
  return json;
}

constexpr bench::Suite kSuite{
    .name = "sim",
    .description =
        "Measures the steps of the simulation, 240 per second against maps at 30 Hz: boxes that "
        "fall on a real block and come to rest, curtains that a real arm moves, and particles on a "
        "block that an arm crosses at 1 m/s (wide: five eighths fall beside the block). A step's "
        "time is the mean over a frame, with the detection of contacts and the preparation of the "
        "frame's hull.",
    .example = "fivepipe bench sim --json out/sim.json",
    .only_help =
        "only results whose name contains this text, such as bodies, cloth/720 or particles"};

void run(const bench::Args& args) {
  std::cout << base::machine_line("") << std::endl;
  base::TextTable table(
      {{"scene"}, {"step, ms", true}, {"p95", true}, {"frame p95", true}, {"error"}});
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  const auto add = [&](const std::string& name, const auto& measure) {
    if (name.find(args.only) == std::string::npos) return;
    std::cerr << "bench sim: " << name << std::endl;
    const Result result = measure();
    entries.push_back(json_of(result, args.threads));
    table.add({result.name, base::with_decimals(base::percentile(result.step_ms, 0.5), 3),
               base::with_decimals(base::percentile(result.step_ms, 0.95), 3),
               base::with_decimals(base::percentile(result.frame_ms, 0.95), 1), result.errors});
  };
  for (const int count : {1, 10, 50, 200})
    add(fmt::format("bodies/{}", count), [&] { return fallen_boxes(count, args); });
  for (const auto& [columns, rows] : {std::pair{20, 18}, {50, 50}, {100, 100}, {158, 158}}) {
    const bool with_reference = columns == 20 && !args.quick;
    add(fmt::format("cloth/{}", 2 * columns * rows), [&, columns = columns, rows = rows] {
      return moved_curtain(columns, rows, with_reference, args);
    });
  }
  for (const auto& [count, rain_on] : {std::pair{1000, Rain::block},
                                       {10'000, Rain::wide},
                                       {10'000, Rain::block},
                                       {100'000, Rain::block}})
    add(particles_name(count, rain_on), [&, count = count, rain_on = rain_on] {
      return swept_particles(count, rain_on, args.threads, args.quick);
    });
  std::cout << table.text();
  if (!args.json_file.empty())
    base::write_json(args.json_file, base::suite_json("sim", "", entries));
}

}  // namespace
}  // namespace fivepipe::sim_bench

int main(int argc, char** argv) {
  return fivepipe::bench::run_suite(fivepipe::sim_bench::kSuite, argc, argv,
                                    fivepipe::sim_bench::run);
}
