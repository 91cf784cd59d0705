// The architecture's layers, checked on the include lines of the sources.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace fivepipe::test {
namespace {

namespace fs = std::filesystem;

struct Source {
  std::string path;    // from the root, "common/hull/hull.h"
  std::string folder;  // "common/hull", "recon_node"
  std::vector<std::string> lines, includes;
};

std::vector<Source> all_sources() {
  const fs::path root = FIVEPIPE_SOURCE_DIR;
  static const std::regex include("^\\s*#include\\s+[<\"]([^>\"]+)[>\"].*");
  std::vector<Source> sources;
  for (const char* top :
       {"common", "capture_node", "recon_node", "sim_node", "render_node", "launch"})
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      Source source;
      source.path = fs::relative(entry.path(), root);
      const auto second = source.path.find('/', source.path.find('/') + 1);
      source.folder = source.path.starts_with("common/")
                          ? source.path.substr(0, second)
                          : source.path.substr(0, source.path.find('/'));
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        std::smatch match;
        if (std::regex_match(line, match, include)) source.includes.push_back(match[1]);
        source.lines.push_back(line);
      }
      sources.push_back(std::move(source));
    }
  return sources;
}

bool is_wiring(const Source& source) {
  const std::string name = fs::path(source.path).filename();
  return name == "main.cpp" || name.starts_with("messages") ||
         name.find("_pipe.") != std::string::npos;
}
bool is_node_folder(const std::string& folder) { return folder.ends_with("_node"); }
bool is_pure(const Source& source) {
  static const std::set<std::string> pure = {
      "common/geometry", "common/hull",    "common/collision", "common/frames",
      "common/scene",    "common/gl",      "common/mcap",      "common/recording",
      "common/schema",   "common/version", "common/workers"};
  return pure.contains(source.folder) || (is_node_folder(source.folder) && !is_wiring(source));
}

TEST(Layering, OnlyTheBusCallsDds) {
  static const std::regex call("\\bdds_[a-z_]+ *\\(");
  for (const Source& source : all_sources()) {
    if (source.folder == "common/bus") continue;
    for (const std::string& line : source.lines)
      EXPECT_FALSE(std::regex_search(line, call)) << source.path << ": " << line;
    for (const std::string& include : source.includes)
      EXPECT_FALSE(include.starts_with("dds/")) << source.path;
  }
}

TEST(Layering, PureLibrariesDoNotDependOnDdsOrGlContext) {
  for (const Source& source : all_sources()) {
    if (!is_pure(source)) continue;
    for (const std::string& include : source.includes) {
      EXPECT_FALSE(include.starts_with("dds/") || include == "fivepipe.h" ||
                   include.starts_with("common/bus/") || include.starts_with("common/node/") ||
                   include.starts_with("common/messages/"))
          << source.path << " includes " << include;
      const bool makes_contexts = source.path.starts_with("common/gl/context.") ||
                                  fs::path(source.path).filename().string().starts_with("bench_") ||
                                  fs::path(source.path).filename().string().starts_with("window.");
      EXPECT_TRUE(makes_contexts || (include != "common/gl/context.h" && include != "epoxy/egl.h" &&
                                     include != "EGL/egl.h"))
          << source.path << " includes " << include;
    }
  }
}

TEST(Layering, NodesDoNotDependOnEachOther) {
  for (const Source& source : all_sources())
    for (const std::string& include : source.includes) {
      const std::string target = include.substr(0, include.find('/'));
      EXPECT_TRUE(!is_node_folder(target) || source.folder == target)
          << source.path << " includes " << include;
    }
}

TEST(Layering, FolderDependenciesAreAcyclic) {
  std::map<std::string, std::set<std::string>> uses;
  for (const Source& source : all_sources())
    for (const std::string& include : source.includes) {
      if (!include.starts_with("common/")) continue;
      const std::string target = include.substr(0, include.find('/', 7));
      if (target != source.folder) uses[source.folder].insert(target);
    }
  std::set<std::string> done, open;
  std::function<void(const std::string&)> visit = [&](const std::string& folder) {
    ASSERT_FALSE(open.contains(folder)) << folder << " depends on itself through others";
    if (done.contains(folder)) return;
    open.insert(folder);
    for (const std::string& target : uses[folder]) visit(target);
    open.erase(folder);
    done.insert(folder);
  };
  for (const auto& [folder, targets] : std::map(uses)) visit(folder);
}

TEST(Layering, MainDoesWiringOnly) {
  for (const Source& source : all_sources())
    EXPECT_TRUE(!is_node_folder(source.folder) || fs::path(source.path).filename() != "main.cpp" ||
                source.lines.size() < 100)
        << source.path;
}

TEST(Layering, TopicNamesAppearOnce) {
  for (const Source& source : all_sources())
    for (const std::string& line : source.lines)
      EXPECT_TRUE(line.find("\"fivepipe/v1/") == std::string::npos ||
                  source.path == "common/bus/topics.h")
          << source.path << ": " << line;
}

}  // namespace
}  // namespace fivepipe::test
