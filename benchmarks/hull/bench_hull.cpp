// fivepipe bench hull: time and error of the hull's depth from a novel viewpoint, of fivepipe's
// backends and of the baselines.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <stdexcept>

#include "benchmarks/hull/hull_report.h"
#include "benchmarks/hull/methods.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "common/gl/context.h"

namespace fivepipe::hull_bench {
namespace {

struct Size {
  int width_px, height_px;
};

double timed_ms(const Method& method, const HullScene& scene, const hull::View& view,
                std::span<float> depth_m) {
  const auto start = std::chrono::steady_clock::now();
  method.depth(scene, view, depth_m);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

// every_pixel: also compares the exact methods with the reference in every pixel.
std::vector<Result> measure(const HullScene& scene, const Size& size,
                            std::span<const Method> methods, const base::Budget& budget, int rays,
                            bool every_pixel) {
  const hull::View view = view_of(scene, size.width_px, size.height_px);
  std::vector<Result> results(methods.size());
  std::vector<std::vector<float>> depths(
      methods.size(), std::vector<float>(std::size_t(size.width_px) * size.height_px));
  base::time_round_robin(methods.size(), budget, [&](std::size_t m, bool counted) {
    const double ms = timed_ms(methods[m], scene, view, depths[m]);
    if (counted) results[m].time_ms.push_back(ms);
    return ms;
  });
  std::vector<float> by_cpu(depths.front().size());
  cpu_method(1).depth(scene, view, by_cpu);
  const int surface_rays =
      scene.silhouettes.size() <= 4 ? 200 : 0;  // true silhouettes of many cameras take long
  const Truth truth(scene, view, by_cpu, rays, surface_rays);
  std::vector<double> reference_m;
  if (every_pixel) {
    base::WorkerPool pool(methods.front().threads);
    reference_m = reference_depths_m(scene, view, pool);
  }
  for (std::size_t m = 0; m < methods.size(); ++m) {
    Result& r = results[m];
    r.method = methods[m].name;
    r.scene = scene.name;
    r.width_px = size.width_px;
    r.height_px = size.height_px;
    r.threads = methods[m].threads;
    r.cameras = int(scene.silhouettes.size());
    r.hits = int(std::count_if(depths[m].begin(), depths[m].end(),
                               [](float d) { return d != hull::kNoHull; }));
    r.errors = truth.errors_of(depths[m], methods[m].spacing_mm(view), methods[m].exact);
    if (every_pixel && methods[m].exact) r.pixels = compare_every_pixel(depths[m], reference_m);
    r.checksum = checksum(depths[m]);
    r.maps_covered = covered_fraction(scene);
    r.footprint_mm = 1000 * pixel_footprint_m(scene);
    r.map_width_px = scene.silhouettes.front().pixels.width_px();
    r.map_height_px = scene.silhouettes.front().pixels.height_px();
  }
  return results;
}

class HullBenchmark {
 public:
  explicit HullBenchmark(const bench::Args& args) : args_(args) {
    std::cout << base::machine_line(context_.renderer()) << std::endl;
  }

  void run() {
    if (args_.every_pixel) return check_every_pixel();
    std::vector<HullScene> scenes = synthetic_scenes();
    for (const std::string& folder : args_.maps)
      scenes.push_back(real_scene(folder));  // throws before the measurements start
    for (const HullScene& scene : scenes) run_scene(scene, sizes_of(scene));
    if (args_.maps.empty())
      std::cout << "real maps: none; write those of a deployment with `fivepipe maps` and pass "
                   "--maps FOLDER\n";
    if (!args_.quick) run_series();
    std::cout << '\n';
    print(results_);
    print_ratios(results_);
    if (args_.full) print_every_pixel(results_);
    write_files();
  }

 private:
  // Compares cpu and gl with the reference; measures no times.
  void check_every_pixel() {
    std::vector<Views> all = all_views();
    for (const std::string& folder : args_.maps)
      all.push_back({{real_scene(folder)}, {{640, 480}}});
    base::WorkerPool pool(args_.threads);
    std::vector<PixelRow> rows;
    for (const Views& views : all)
      for (const HullScene& scene : views.scenes)
        for (const auto& [width_px, height_px] : views.sizes_px) {
          std::vector<Method> chosen{cpu_method(args_.threads), gl_method(args_.threads)};
          keep_chosen(chosen, scene);
          if (chosen.empty()) continue;
          show_progress(scene.name, width_px, height_px);
          const hull::View view = view_of(scene, width_px, height_px);
          const std::vector<double> reference_m = reference_depths_m(scene, view, pool);
          for (const Method& method : chosen) {
            std::vector<float> depth_m(reference_m.size());
            method.depth(scene, view, depth_m);
            rows.push_back({scene.name, method.name, width_px, height_px,
                            compare_every_pixel(depth_m, reference_m)});
          }
        }
    std::cerr << '\r';
    std::cout << every_pixel_table(rows);
    if (!args_.json_file.empty())
      write_every_pixel_json(args_.json_file, rows, context_.renderer());
    if (std::any_of(rows.begin(), rows.end(),
                    [](const PixelRow& row) { return row.errors.wrong > 0; }))
      throw std::runtime_error("a backend is wrong in a pixel");
  }

  void keep_chosen(std::vector<Method>& methods, const HullScene& scene) const {
    std::erase_if(methods, [&](const Method& m) {
      return !m.supports(scene) ||
             (m.name + "/" + scene.name).find(args_.only) == std::string::npos;
    });
  }
  static void show_progress(const std::string& scene, int width_px, int height_px) {
    std::cerr << fmt::format("\r{:<40}", fmt::format("{} {}x{}", scene, width_px, height_px));
  }

  std::vector<Size> sizes_of(const HullScene& scene) const {
    if (args_.quick) return {{160, 120}};
    if (args_.full || scene.name == "hand4" || scene.name == "hand4-near")
      return {{320, 240}, {640, 480}, {1920, 1080}};
    return {{640, 480}};
  }

  void run_scene(const HullScene& scene, const std::vector<Size>& sizes) {
    for (const Size& size : sizes) {
      const bool large = size.width_px > 640;
      std::vector<Method> methods{cpu_method(args_.threads), image_based_method(args_.threads)};
      if (args_.threads > 1 && !large)
        methods.push_back(cpu_method(1)), methods.push_back(image_based_method(1));
      methods.push_back(gl_method(args_.threads));
      for (const int planes :
           args_.full ? std::vector{64, 128, 256, 320, 512} : std::vector{64, 320})
        methods.push_back(cpu_sweep_method(planes, false, args_.threads));
      for (const int planes :
           args_.full ? std::vector{64, 128, 144, 160, 256} : std::vector{64, 160})
        methods.push_back(cpu_sweep_method(planes, true, args_.threads));
      methods.push_back(plain_sweep_method(160, args_.threads));
      for (const double voxel_mm :
           args_.full ? std::vector{8.0, 5.0, 4.5, 4.0, 2.0, 1.0} : std::vector{8.0, 4.5, 2.0})
        methods.push_back(carving_method(voxel_mm, args_.threads));
      if (scene.silhouettes.size() <= 4 && !large)
        for (const int planes : args_.full ? std::vector{64, 256} : std::vector{64})
          methods.push_back(gl_sweep_method(planes, args_.threads));
      add(scene, size, methods);
    }
  }

  // Time against the number of cameras, the view's size and its coverage.
  void run_series() {
    std::vector<Method> methods{cpu_method(args_.threads), image_based_method(args_.threads)};
    if (args_.full) methods.push_back(gl_method(args_.threads));
    for (const HullScene& scene : series_scenes()) add(scene, {640, 480}, methods);
    for (const Size& size : {Size{160, 120}, {1280, 960}})
      add(hand_scene("hand4", 0.68, 1.0), size, methods);
  }

  void add(const HullScene& scene, const Size& size, std::vector<Method> methods) {
    keep_chosen(methods, scene);
    if (methods.empty()) return;
    show_progress(scene.name, size.width_px, size.height_px);
    const base::Budget budget = args_.quick  ? base::Budget{3, 1, 0.05}
                                : args_.full ? base::Budget{101, 5, 4.0}
                                             : base::Budget{31, 3, 1.0};
    for (Result& r : measure(scene, size, methods, budget,
                             args_.quick                     ? 200
                             : scene.silhouettes.size() > 16 ? 600
                                                             : 2000,
                             args_.full))
      results_.push_back(std::move(r));
  }

  void write_files() const {
    std::cerr << '\r';
    if (!args_.json_file.empty()) write_json(args_.json_file, results_, context_.renderer());
    if (!args_.plot_file.empty() && !plot(results_, args_.plot_file))
      std::cerr << "cannot run gnuplot; its script and data are beside " << args_.plot_file << '\n';
  }

  bench::Args args_;
  gl::GlContext context_;
  std::vector<Result> results_;
};

constexpr bench::Suite kSuite{
    .name = "hull",
    .description =
        "Measures time and error of the visual hull's depth from a novel viewpoint, from packed "
        "maps to depth.\n"
        "Methods: backends cpu and gl; the paper's plane sweep on OpenGL and on the CPU; "
        "image-based visual hulls (ibvh); voxel carving.\n"
        "The default run takes about three minutes.",
    .example = "fivepipe bench hull --json out/hull.json --plot out/hull.png",
    .plot_help = "plot to this file (.png or .svg) with gnuplot",
    .maps_help = "also measure real maps: a folder written by `fivepipe maps` (repeatable)",
    .only_help = "run only results whose METHOD/SCENE contains this text: cpu/, /hand4",
    .full_help =
        "run every scene at 320x240, 640x480 and 1920x1080, with more planes, voxel sizes "
        "and runs, and compare cpu and gl with the reference in every pixel of every view",
    .every_pixel_help =
        "measure no times, but compare cpu and gl with the reference in every pixel of every view "
        "of --full, and of --maps at 640x480; exit code 1 if one is wrong"};

}  // namespace
}  // namespace fivepipe::hull_bench

int main(int argc, char** argv) {
  using namespace fivepipe;
  return bench::run_suite(hull_bench::kSuite, argc, argv,
                          [](const bench::Args& args) { hull_bench::HullBenchmark(args).run(); });
}
