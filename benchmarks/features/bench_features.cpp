// fivepipe bench features: the time of a plain scene, and of the same scene with one feature more.
#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "benchmarks/features/feature_scenes.h"
#include "benchmarks/features/scene_run.h"
#include "benchmarks/nodes/loaded_libraries.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/gl/context.h"

namespace fivepipe::feature_bench {
namespace {

using node_bench::Libraries, node_bench::libraries_of_nodes, node_bench::difference_text;

// A folder for the deployments. The destructor removes it.
class WorkFolder {
 public:
  WorkFolder()
      : path(std::filesystem::temp_directory_path() /
             fmt::format("fivepipe_features_{}", getpid())) {}
  ~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  config::Deployment deployment_of(const Feature& feature) const {
    return config::load_deployment(
        write_deployment(path / feature.name, feature, ImageSize::paper));
  }

  const std::filesystem::path path;
};

struct Measured {
  std::string name;
  std::unique_ptr<SceneRun> run;
  std::uint64_t checksum = 0;
  std::string libraries = "-";
};

constexpr const char* kAgain = "base_again";

std::vector<Feature> chosen(const std::string& only) {
  std::vector<Feature> chosen;
  for (const Feature& feature : features())
    if (feature.name.find(only) != std::string::npos) chosen.push_back(feature);
  return chosen;
}

// The base, each feature, and the base again: a simulation and a renderer of its own that are made
// after those of all features. Each frame advances and draws all scenes and starts with another
// one.
std::vector<Measured> measured(const WorkFolder& work, const std::vector<Feature>& with,
                               const bench::Args& args) {
  const int frames = args.quick ? 4 : 150;
  const std::vector<RealFrame> real = real_frames(
      work.deployment_of({"light", "shadows: {target_m: [0, 0, 0.1], fov_deg: 50}\n"}), frames);
  std::vector<Measured> scenes;
  const auto add = [&](const Feature& feature, const std::string& name) {
    scenes.push_back({name, std::make_unique<SceneRun>(work.deployment_of(feature), args.threads)});
  };
  add(kBase, kBase.name);
  for (const Feature& feature : with) add(feature, feature.name);
  add(kBase, kAgain);
  std::vector<std::size_t> next(scenes.size(), 0);
  base::time_round_robin(scenes.size(), {frames - 1, frames - 1, 0},
                         [&](std::size_t scene, bool counted) {
                           SceneRun& run = *scenes[scene].run;
                           const RealFrame& frame = real[next[scene]++];
                           const double steps_ms = run.advance(frame), draw_ms = run.draw(frame);
                           if (counted) {
                             run.steps_ms.push_back(steps_ms);
                             run.draw_ms.push_back(draw_ms);
                           }
                           return steps_ms + draw_ms;
                         });
  for (Measured& scene : scenes) scene.checksum = scene.run->checksum();
  if (scenes.front().checksum != scenes.back().checksum)
    throw std::runtime_error("the base scene differs if a scene with features ran beside it");
  return scenes;
}

// "1.02 (0.97-1.10)": the ratio of the medians, and of the times of a frame from p5 to p95.
std::string ratio_text(const std::vector<double>& ms, const std::vector<double>& base_ms) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < ms.size(); ++i) ratios.push_back(ms[i] / base_ms[i]);
  return fmt::format("{:.2f} ({:.2f}-{:.2f})",
                     base::percentile(ms, 0.5) / base::percentile(base_ms, 0.5),
                     base::percentile(ratios, 0.05), base::percentile(ratios, 0.95));
}

void print(const std::vector<Measured>& scenes) {
  base::TextTable table({{"scene"},
                         {"steps of a frame, ms", true},
                         {"to base (p5-p95)", true},
                         {"drawing, ms", true},
                         {"to base (p5-p95)", true},
                         {"loaded libraries"}});
  const SceneRun& base = *scenes.front().run;
  for (const Measured& scene : scenes)
    table.add({scene.name, base::with_decimals(base::percentile(scene.run->steps_ms, 0.5), 3),
               ratio_text(scene.run->steps_ms, base.steps_ms),
               base::with_decimals(base::percentile(scene.run->draw_ms, 0.5), 3),
               ratio_text(scene.run->draw_ms, base.draw_ms), scene.libraries});
  std::cout << table.text();
}

// Runs the nodes of the base and of each feature. A quick run does so for one feature.
void add_libraries(const WorkFolder& work, const std::vector<Feature>& with, bool is_quick,
                   std::vector<Measured>& scenes) {
  const auto libraries_of = [&](const Feature& feature) {
    std::cerr << "bench features: nodes of " << feature.name << std::endl;
    const auto folder = work.path / "live" / feature.name;
    return libraries_of_nodes(write_deployment(folder, feature, ImageSize::live), folder / "out");
  };
  const std::map<std::string, Libraries> base = libraries_of(kBase);
  std::string counts;
  for (const auto& [program, libraries] : base)
    counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", program, libraries.size());
  scenes.front().libraries = counts;
  for (std::size_t i = 0; i < with.size() && !(is_quick && i > 0); ++i)
    scenes[i + 1].libraries = difference_text(base, libraries_of(with[i]));
}

nlohmann::ordered_json json_of(const std::vector<Measured>& scenes, int threads) {
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const Measured& scene : scenes) {
    const std::string checksum = fmt::format("{:x}", scene.checksum);
    results.push_back({{"name", fmt::format("features/{}/steps/{}", scene.name, threads)},
                       {"time_ms", base::times_json(scene.run->steps_ms)},
                       {"checksum", checksum},
                       {"libraries", scene.libraries}});
    results.push_back({{"name", fmt::format("features/{}/drawing/{}", scene.name, threads)},
                       {"time_ms", base::times_json(scene.run->draw_ms)},
                       {"checksum", checksum}});
  }
  return results;
}

constexpr bench::Suite kSuite{
    .name = "features",
    .description =
        "Measures a plain scene and the same scene with one feature more: cloth, bodies, joints, "
        "particles, shadows, lit (light on real objects) and history. Steps: all steps of the "
        "simulation for a frame, with the preparation of its hull. Drawing: of that frame, without "
        "reading it back. `to base` is the ratio of the medians; in parentheses, p5 and p95 over "
        "the frames of the ratio to the base's time of the same frame. The row base_again shows "
        "the noise. Loaded libraries: for the base, their number in each node after ten "
        "composited frames; for a feature, the difference. The reconstruction of the light's view "
        "is not included; fivepipe bench render prints its time.",
    .example = "fivepipe bench features --json out/features.json",
    .only_help = "only features whose name contains this text, such as cloth"};

void run(const bench::Args& args) {
  const std::vector<Feature> with = chosen(args.only);
  if (with.empty()) throw std::runtime_error("no feature's name contains '" + args.only + "'");
  const WorkFolder work;
  const gl::GlContext gl;
  std::cout << base::machine_line(gl.renderer()) << std::endl;
  std::vector<Measured> scenes = measured(work, with, args);
  add_libraries(work, with, args.quick, scenes);
  print(scenes);
  if (!args.json_file.empty())
    base::write_json(args.json_file,
                     base::suite_json("features", gl.renderer(), json_of(scenes, args.threads)));
}

}  // namespace
}  // namespace fivepipe::feature_bench

int main(int argc, char** argv) {
  return fivepipe::bench::run_suite(fivepipe::feature_bench::kSuite, argc, argv,
                                    fivepipe::feature_bench::run);
}
