// The suite `fivepipe bench features`: its scenes, the list of loaded libraries, and a quick run.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "benchmarks/features/feature_scenes.h"
#include "benchmarks/nodes/loaded_libraries.h"
#include "common/config/deployment.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::feature_bench {
namespace {

using node_bench::Libraries, node_bench::libraries_of_nodes, node_bench::difference_text;
using node_bench::loaded_libraries;

namespace fs = std::filesystem;

std::size_t objects_with(const config::Scene& scene, config::Motion motion) {
  return std::size_t(std::count_if(scene.objects.begin(), scene.objects.end(),
                                   [&](const auto& object) { return object.motion == motion; }));
}

// The features that a scene has.
std::set<std::string> found_in(const config::Scene& scene) {
  std::set<std::string> found;
  if (objects_with(scene, config::Motion::cloth)) found.insert("cloth");
  for (const config::SceneObject& object : scene.objects)
    if (object.motion == config::Motion::dynamic) found.insert(object.joint ? "joints" : "bodies");
  if (!scene.particles.empty()) found.insert("particles");
  if (scene.shadows) found.insert("shadows");
  if (scene.lights_real_objects) found.insert("lit");
  if (scene.history) found.insert("history");
  return found;
}

TEST(FeatureScenes, HaveTheBasesObjectsAndTheirFeatureAlone) {
  const test::TestFolder folder;
  for (const ImageSize size : {ImageSize::paper, ImageSize::live}) {
    const config::Scene base =
        config::load_deployment(write_deployment(folder.path / "base", kBase, size)).scene;
    EXPECT_EQ(found_in(base), std::set<std::string>{});
    std::set<std::string> names;
    for (const Feature& feature : features()) {
      const config::Deployment with =
          config::load_deployment(write_deployment(folder.path / feature.name, feature, size));
      EXPECT_EQ(found_in(with.scene), std::set<std::string>{feature.name});
      ASSERT_GE(with.scene.objects.size(), base.objects.size());
      for (std::size_t i = 0; i < base.objects.size(); ++i)
        EXPECT_EQ(with.scene.objects[i].name, base.objects[i].name);
      names.insert(feature.name);
    }
    EXPECT_EQ(names, (std::set<std::string>{"cloth", "bodies", "joints", "particles", "shadows",
                                            "lit", "history"}));
  }
}

TEST(LoadedLibraries, AreThoseThatAreLinkedAndThoseThatAreOpened) {
  const Libraries before = loaded_libraries(getpid());
  EXPECT_TRUE(before.contains("libc.so.6")) << before.size();
  for (const std::string& name : before) EXPECT_TRUE(test::contains(name, ".so")) << name;
  const std::string other = "libBrokenLocale.so.1";  // of the C library; no program needs it
  ASSERT_FALSE(before.contains(other));
  void* const opened = dlopen(other.c_str(), RTLD_NOW);
  ASSERT_TRUE(opened) << dlerror();
  Libraries expected = before;
  expected.insert(other);
  EXPECT_EQ(loaded_libraries(getpid()), expected);
  dlclose(opened);
  EXPECT_EQ(loaded_libraries(-1), Libraries{}) << "no process";
}

TEST(LoadedLibraries, TheirDifferenceNamesTheProgram) {
  const std::map<std::string, Libraries> base = {{"sim_node", {"a.so", "b.so"}},
                                                 {"render_node", {"a.so"}}};
  EXPECT_EQ(difference_text(base, base), "the same");
  EXPECT_EQ(difference_text(base, {{"sim_node", {"a.so", "c.so"}}, {"render_node", {"a.so"}}}),
            "sim_node: +c.so -b.so");
  EXPECT_EQ(difference_text({{"render_node", {"a.so"}}}, base), "sim_node: +a.so +b.so");
}

int run_suite(const std::string& arguments, const fs::path& output) {
  const int status = std::system((FIVEPIPE_BINARY_DIR "/fivepipe bench features " + arguments +
                                  " >" + output.string() + " 2>&1")
                                     .c_str());
  return WEXITSTATUS(status);
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(FeaturesSuite, MeasuresTheBaseAndAFeatureAndListsLibraries) {
  const test::TestFolder folder;
  const fs::path json_file = folder.path / "features.json", output = folder.path / "output";
  ASSERT_EQ(run_suite("--quick --only cloth --threads 1 --json " + json_file.string(), output), 0)
      << content_of(output);
  const auto json = nlohmann::json::parse(content_of(json_file));
  EXPECT_EQ(json["suite"], "features");
  std::vector<std::string> names;
  std::map<std::string, nlohmann::json> results;
  for (const auto& result : json["results"]) {
    names.push_back(result["name"]);
    results[names.back()] = result;
    EXPECT_EQ(result["time_ms"]["runs"], 3) << "the first frame warms up";
    EXPECT_GT(result["time_ms"]["median"].get<double>(), 0);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"features/base/steps/1", "features/base/drawing/1",
                                             "features/cloth/steps/1", "features/cloth/drawing/1",
                                             "features/base_again/steps/1",
                                             "features/base_again/drawing/1"}));
  EXPECT_EQ(results["features/base/steps/1"]["checksum"],
            results["features/base_again/steps/1"]["checksum"]);
  EXPECT_NE(results["features/base/steps/1"]["checksum"],
            results["features/cloth/steps/1"]["checksum"])
      << "the cloth is simulated and drawn";
  for (const std::string program : {"capture_node ", "recon_node ", "sim_node ", "render_node "})
    EXPECT_TRUE(test::contains(results["features/base/steps/1"]["libraries"], program)) << program;
  EXPECT_EQ(results["features/cloth/steps/1"]["libraries"], "the same");
  EXPECT_TRUE(test::contains(content_of(output), "\nbase_again ")) << content_of(output);
}

// The hull needs a colour here: the renderer lights a hull without colour in every scene, so the
// image would equal the base's.
TEST(FeaturesSuite, LightOnRealObjectsChangesTheImage) {
  const test::TestFolder folder;
  const fs::path json_file = folder.path / "features.json", output = folder.path / "output";
  ASSERT_EQ(run_suite("--quick --only lit --threads 1 --json " + json_file.string(), output), 0)
      << content_of(output);
  std::map<std::string, std::string> checksums;
  const auto json = nlohmann::json::parse(content_of(json_file));
  for (const auto& result : json["results"]) checksums[result["name"]] = result["checksum"];
  EXPECT_NE(checksums.at("features/lit/drawing/1"), checksums.at("features/base/drawing/1"));
}

TEST(FeaturesSuite, RefusesAFeatureThatDoesNotExist) {
  const test::TestFolder folder;
  EXPECT_EQ(run_suite("--quick --only hair", folder.path / "output"), 1);
  EXPECT_EQ(content_of(folder.path / "output"),
            "bench features: no feature's name contains 'hair'\n");
}

}  // namespace
}  // namespace fivepipe::feature_bench
