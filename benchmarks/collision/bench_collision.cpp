// fivepipe bench collision: how fast, and how right, virtual objects are collided with the hull:
// the paper's way, ours, and what could be picked instead.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "benchmarks/collision/methods.h"
#include "benchmarks/collision/normals.h"
#include "benchmarks/collision/paper_model_fits.h"
#include "benchmarks/collision/proximities.h"
#include "benchmarks/collision/results.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "common/gl/context.h"

namespace fivepipe::collision_bench {
namespace {

using base::Budget;
using bench::Args;

// More triangles than that, and methods that ask each of them take seconds a frame: only with
// --full.
constexpr std::size_t kMany = 200000;
// Triangles near the hull whose truth is asked.
constexpr std::size_t kMaxExactTests = 2000;

// Polygonised more finely, a frame takes seconds. The finger of the thin scene is 2 mm thick.
double finest_cell_mm(const CollisionScene& scene, const bench::Args& args) {
  if (scene.name == "thin") return 0.5;
  return scene.name == "real" && !args.full ? 2.0 : 1.0;
}

std::vector<Method> methods_for(const CollisionScene& scene, const bench::Args& args) {
  const bool all = args.full || scene.triangles() < kMany;
  std::vector<Method> methods;
  for (const int viewport_px : all ? std::vector{5, 10, 20, 40} : std::vector{10})
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

void take(const Answer& answer, const std::optional<double>& response_ms, Result& result) {
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
    if (counted) take(answers[m], response_ms, results[m]);
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
    r.wrong = wrong_of(answers[m].objects, truth, scene);
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
  std::printf(
      "%-10s %zu objects, %zu triangles, %zu cameras; %.2f %% of the triangles cross the hull's "
      "border, %.2f %% have a point in the hull, %.2f %% are within %g mm of it\n",
      scene.name.c_str(), scene.objects.size(), counts.triangles, scene.silhouettes.size(),
      100 * double(counts.crossing_border) / all, 100 * double(counts.crossing) / all,
      100 * double(counts.near) / all, 1000 * kNear_m);
}

class Suite {
 public:
  explicit Suite(const bench::Args& args) : args_(args) {
    context_.emplace();
    std::printf("%s\n", base::machine_line(context_->renderer()).c_str());
    if (!why_no_fcl().empty()) std::printf("fcl: skipped, %s\n", why_no_fcl().c_str());
  }

  void run() {
    std::vector<CollisionScene> real;
    for (const std::string& folder : args_.maps)
      real.push_back(real_scene(folder));  // what is wrong with one is said at once
    for (const auto& make : {curtain720, blocks, payload, dense, full, thin}) add(make());
    for (const CollisionScene& scene : real) add(scene);
    if (real.empty()) std::puts("real       skipped, no --maps FOLDER (made by `fivepipe maps`)");
    std::fputs("\r", stderr);
    std::puts("");
    if (!results_.empty()) print(results_), print_responses(results_), print_ratios(results_);
    if (asked_for("proximity")) print(proximities_ = measure_proximity(args_.threads, args_.quick));
    if (asked_for("normals")) print(normals_ = measure_normals(args_.quick));
    std::optional<PaperModelFits> laws;
    if (asked_for("laws")) print(laws.emplace(fit_paper_models(args_.quick)));
    if (!args_.json_file.empty()) base::write_file(args_.json_file, json(laws));
    if (args_.plot_file.empty()) return;
    const std::filesystem::path file = args_.plot_file,
                                of_normals =
                                    file.parent_path() /
                                    (file.stem().string() + "_normals" + file.extension().string());
    if (!results_.empty()) drawn(plot(results_, file), file);
    if (!normals_.empty()) drawn(plot(normals_, of_normals), of_normals);
  }

 private:
  bool asked_for(const std::string& part) const {
    return part.find(args_.only) != std::string::npos;
  }
  static void drawn(bool done, const std::filesystem::path& file) {
    if (!done)
      std::fprintf(stderr, "no gnuplot here: its script and numbers are beside %s\n", file.c_str());
  }

  void add(const CollisionScene& scene) {
    std::vector<Method> methods = methods_for(scene, args_);
    std::erase_if(methods, [&](const Method& m) {
      return (m.name + "/" + scene.name + "/" + m.setting).find(args_.only) == std::string::npos;
    });
    if (methods.empty()) return;
    std::fprintf(stderr, "\r%-20s", scene.name.c_str());
    base::WorkerPool pool(args_.threads);
    const Truth truth = exact_truth(scene, kMaxExactTests, pool);
    std::fputs("\r", stderr);
    describe(scene, counts_of(truth));
    const base::Budget budget = args_.quick  ? base::Budget{2, 1, 0.05}
                                : args_.full ? base::Budget{301, 5, 4.0}
                                             : base::Budget{101, 3, 1.0};
    for (Result& r : measure(scene, methods, truth, budget)) results_.push_back(std::move(r));
  }

  std::string json(const std::optional<PaperModelFits>& laws) const {
    std::vector<std::string> lines;
    for (const Result& r : results_) lines.push_back(json_of(r));
    for (const ProximityResult& r : proximities_) lines.push_back(json_of(r));
    for (std::string& line : json_of(normals_)) lines.push_back(std::move(line));
    return base::suite_json("collision", context_->renderer(), lines,
                            laws ? ",\n \"paper_laws\": " + json_of(*laws) : "");
  }

  bench::Args args_;
  std::optional<gl::GlContext> context_;
  std::vector<Result> results_;
  std::vector<ProximityResult> proximities_;
  std::vector<NormalsAt> normals_;
};

constexpr const char* kHelp =
    "fivepipe bench collision [--json FILE] [--plot FILE.png|.svg] [--maps FOLDER] [--threads N] "
    "[--only TEXT] [--full | --quick]\n"
    "Time and error of the collision of virtual meshes with the hull of one frame's maps: backends "
    "cpu and gl, certified; the paper's backend (viewports in a stencil window);\n"
    "every triangle sampled by brute force in vector lanes; the hull polygonised and given to the "
    "Flexible Collision Library (where installed).\n"
    "The response's stages, and its error for the same CP_obj and V_rec; distances to the hull "
    "against a distance transform of voxels; N_hull against the silhouettes' curvature.\n"
    "Then the paper's cost model and accuracy law, fitted to its backend. Some four minutes.\n"
    "  --plot FILE    beside it FILE_normals: N_hull\n"
    "  --maps FOLDER  real maps as well: the folder seated4cam that `fivepipe maps` made\n"
    "  --threads N    of each method (2); those on the CPU on one thread as well\n"
    "  --only TEXT    results whose method/scene/setting has this in it: --only paper, --only "
    "/curtain720; --only laws, proximity, normals: that alone\n"
    "  --full         more runs, and the scene of a million triangles at every setting\n"
    "  --quick        that it runs at all\n"
    "Example: fivepipe bench collision --json out/collision.json --plot out/collision.png\n";

}  // namespace
}  // namespace fivepipe::collision_bench

int main(int argc, char** argv) {
  using namespace fivepipe;
  return bench::run_suite("collision", collision_bench::kHelp, argc, argv,
                          [](const bench::Args& args) { collision_bench::Suite(args).run(); });
}
