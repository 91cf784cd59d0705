// fivepipe bench collision: time and error of collision detection between virtual objects and the
// hull, of fivepipe's backends, the paper's method and the baselines.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <optional>

#include "benchmarks/collision/methods.h"
#include "benchmarks/collision/normals.h"
#include "benchmarks/collision/paper_model_fits.h"
#include "benchmarks/collision/proximities.h"
#include "benchmarks/collision/results.h"
#include "benchmarks/collision/results_json.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "common/gl/context.h"

namespace fivepipe::collision_bench {
namespace {

// With more triangles, a frame of the methods that test each triangle takes seconds; they then run
// with --full only.
constexpr std::size_t kManyTriangles = 200000;

// With smaller cells a frame takes seconds. The fingers of scene thin are 2 mm thick.
double finest_cell_mm(const CollisionScene& scene, const bench::Args& args) {
  if (scene.name == "thin") return 0.5;
  return scene.name == "real" && !args.full ? 2.0 : 1.0;
}

std::vector<Method> methods_for(const CollisionScene& scene, const bench::Args& args) {
  const bool all_viewports = args.full || scene.triangles() < kManyTriangles;
  std::vector<Method> methods;
  for (const int viewport_px : all_viewports ? std::vector{5, 10, 20, 40} : std::vector{10})
    methods.push_back(paper_method(viewport_px, 400, args.threads));
  for (const bool points : {false, true})
    for (const double eps_mm : {3.0, 0.5, 0.1})
      if (!points || eps_mm > 0.2 || args.full)
        methods.push_back(gl_method(eps_mm, points, args.threads));
  for (const int threads : args.threads > 1 ? std::vector{1, args.threads} : std::vector{1}) {
    for (const bool points : {false, true})
      for (const double eps_mm : {3.0, 0.5, 0.1})
        if (!points || eps_mm > 0.2 || args.full)
          methods.push_back(cpu_method(eps_mm, points, threads));
    for (const int across : {10, 60}) methods.push_back(brute_method(across, threads));
    if (!why_no_fcl().empty()) continue;
    for (const double cell_mm : {4.0, 2.0, 1.0, 0.5})
      if (cell_mm >= (threads == 1 || args.full ? finest_cell_mm(scene, args) : 2.0))
        methods.push_back(fcl_method(cell_mm, threads));
  }
  return methods;
}

void append(const Answer& answer, const std::optional<double>& response_ms, Result& result) {
  const Times& t = answer.times;
  result.maps_ms.push_back(t.maps_ms);
  result.build_ms.push_back(t.build_ms);
  result.query_ms.push_back(t.query_ms);
  result.own_ms.push_back(t.own_ms());
  if (response_ms) result.response_ms.push_back(*response_ms);
  result.total_ms.push_back(t.maps_ms + t.own_ms() + response_ms.value_or(0));
}

std::vector<Result> measure(const CollisionScene& scene, const std::vector<Method>& methods,
                            const Truth& truth, const base::Budget& budget) {
  std::vector<Result> results(methods.size());
  std::vector<Answer> answers(methods.size());
  Responses responses(scene);
  base::time_round_robin(methods.size(), budget, [&](std::size_t m, bool counted) {
    answers[m] = methods[m].run(scene);
    const auto response_ms = responses.frame_ms(methods[m], answers[m].objects);
    if (counted) append(answers[m], response_ms, results[m]);
    return answers[m].times.maps_ms + answers[m].times.own_ms() + response_ms.value_or(0);
  });
  for (std::size_t m = 0; m < methods.size(); ++m) {
    Result& r = results[m];
    r.method = methods[m].name;
    r.scene = scene.name;
    r.setting = methods[m].setting;
    r.threads = methods[m].threads;
    r.cameras = int(scene.silhouettes.size());
    r.objects = int(scene.objects.size());
    r.truth = counts_of(truth);
    r.wrong = wrong_of(answers[m].objects, truth);
    r.counts = answers[m].counts;
    r.refit_ms = responses.refit_ms(methods[m]);
    r.response = responses.errors(methods[m]);
    for (const collision::ObjectCollision& object : answers[m].objects)
      r.colliding += object.triangles.size(), r.points += object.points.size();
  }
  return results;
}

void describe(const CollisionScene& scene, const TruthCounts& counts) {
  const double all = double(counts.triangles);
  std::cout << fmt::format(
                   "{:<10} {} objects, {} triangles, {} cameras; {:.2f} % of the triangles cross "
                   "the hull's border, {:.2f} % have a point in the hull, {:.2f} % are within {:g} "
                   "mm of it",
                   scene.name, scene.objects.size(), counts.triangles, scene.silhouettes.size(),
                   100 * double(counts.crossing_border) / all, 100 * double(counts.crossing) / all,
                   100 * double(counts.near) / all, 1000 * kNear_m)
            << std::endl;
}

class CollisionBenchmark {
 public:
  explicit CollisionBenchmark(const bench::Args& args) : args_(args) {
    std::cout << base::machine_line(context_.renderer()) << '\n';
    if (!why_no_fcl().empty()) std::cout << "fcl: skipped; " << why_no_fcl() << '\n';
  }

  void run() {
    std::vector<CollisionScene> real;
    for (const std::string& folder : args_.maps)
      real.push_back(real_scene(folder));  // throws before the measurements start
    for (const auto& make : {curtain720, blocks, payload, dense, full, thin}) add(make());
    for (const CollisionScene& scene : real) add(scene);
    if (real.empty())
      std::cout
          << "real       skipped; write its maps with `fivepipe maps` and pass --maps FOLDER\n";
    std::cerr << '\r';
    std::cout << '\n';
    if (!results_.detections.empty()) {
      print(results_.detections);
      print_responses(results_.detections);
      print_ratios(results_.detections);
    }
    if (selected("proximity"))
      print(results_.proximities = measure_proximity(args_.threads, args_.quick));
    if (selected("normals")) print(results_.normals = measure_normals(args_.quick));
    if (selected("laws")) print(results_.paper_model.emplace(fit_paper_models(args_.quick)));
    if (!args_.json_file.empty()) write_json(args_.json_file, results_, context_.renderer());
    if (!args_.plot_file.empty()) draw_plots();
  }

 private:
  bool selected(const std::string& part) const {
    return part.find(args_.only) != std::string::npos;
  }

  void draw_plots() const {
    const std::filesystem::path file = args_.plot_file,
                                normals_file =
                                    file.parent_path() /
                                    (file.stem().string() + "_normals" + file.extension().string());
    const auto report = [](bool drawn, const std::filesystem::path& drawn_file) {
      if (!drawn)
        std::cerr << "cannot run gnuplot; its script and data are beside " << drawn_file.string()
                  << '\n';
    };
    if (!results_.detections.empty()) report(plot(results_.detections, file), file);
    if (!results_.normals.empty()) report(plot(results_.normals, normals_file), normals_file);
  }

  void add(const CollisionScene& scene) {
    std::vector<Method> methods = methods_for(scene, args_);
    std::erase_if(methods, [&](const Method& m) {
      return (m.name + "/" + scene.name + "/" + m.setting).find(args_.only) == std::string::npos;
    });
    if (methods.empty()) return;
    std::cerr << fmt::format("\r{:<20}", scene.name);
    base::WorkerPool pool(args_.threads);
    const Truth truth = exact_truth(scene, pool);
    std::cerr << '\r';
    describe(scene, counts_of(truth));
    const base::Budget budget = args_.quick  ? base::Budget{2, 1, 0.05}
                                : args_.full ? base::Budget{301, 5, 4.0}
                                             : base::Budget{101, 3, 1.0};
    for (Result& r : measure(scene, methods, truth, budget))
      results_.detections.push_back(std::move(r));
  }

  bench::Args args_;
  gl::GlContext context_;
  AllResults results_;
};

constexpr bench::Suite kSuite{
    .name = "collision",
    .description =
        "Measures time and error of the collision of virtual meshes with the hull of one frame's "
        "maps.\n"
        "Methods: backends cpu and gl (certified); the paper's backend; brute force with SIMD "
        "samples on every triangle; the polygonised hull in the Flexible Collision Library (if "
        "installed), with a point-in-volume test of its grid.\n"
        "It also measures the stages and the error of the response, distances to the hull "
        "(proximity), N_hull (normals), and the fit of the paper's cost and accuracy models "
        "(laws).\n"
        "The default run takes about four minutes.",
    .example = "fivepipe bench collision --json out/collision.json --plot out/collision.png",
    .plot_help = "plot to this file (.png or .svg) with gnuplot; N_hull goes to FILE_normals",
    .maps_help = "also measure real maps: the folder seated4cam written by `fivepipe maps`",
    .only_help =
        "run only results whose METHOD/SCENE/SETTING contains this text (paper, "
        "/curtain720), or only laws, proximity or normals",
    .full_help = "run more often, and run the scene of a million triangles at every setting"};

}  // namespace
}  // namespace fivepipe::collision_bench

int main(int argc, char** argv) {
  using namespace fivepipe;
  return bench::run_suite(collision_bench::kSuite, argc, argv, [](const bench::Args& args) {
    collision_bench::CollisionBenchmark(args).run();
  });
}
