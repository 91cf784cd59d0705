// Checks the layers of the architecture, and the sizes that CONTRIBUTING.md states, on the sources.
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

#include "tests/support/source_text.h"

namespace fivepipe::test {
namespace {

namespace fs = std::filesystem;

struct Source {
  std::string path;    // from the root: "common/hull/cpu/cpu_hull.cpp"
  std::string folder;  // "common/hull/cpu"
  std::string name;    // "cpu_hull.cpp"
  std::vector<std::string> lines, includes;

  bool is_in(const std::string& parent) const {
    return folder == parent || folder.starts_with(parent + "/");
  }
};

const std::vector<std::string> kProduction = {
    "common", "capture_node", "recon_node", "sim_node", "render_node", "launch", "benchmarks"};

std::vector<Source> sources_in(const std::vector<std::string>& tops,
                               const std::set<std::string>& extensions = {".h", ".cpp"}) {
  static const std::regex include("^\\s*#include\\s+[<\"]([^>\"]+)[>\"].*");
  std::vector<Source> sources;
  for (const std::string& top : tops)
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top)) {
      if (!entry.is_regular_file() || !extensions.contains(entry.path().extension())) continue;
      Source source;
      source.path = fs::relative(entry.path(), kRoot);
      source.folder = fs::path(source.path).parent_path();
      source.name = entry.path().filename();
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

const std::vector<Source>& production() {
  static const std::vector<Source> sources = sources_in(kProduction);
  return sources;
}

std::string top_of(const std::string& path) { return path.substr(0, path.find('/')); }
bool is_node(const std::string& path) { return top_of(path).ends_with("_node"); }

// The parts of a node that connect its pure library to the bus. recon_node's frame_inputs.* keeps
// converted messages.
bool is_wiring(const Source& source) {
  return is_node(source.path) &&
         (source.name == "main.cpp" || source.name.starts_with("messages") ||
          source.name.starts_with("frame_inputs.") ||
          source.name.find("_pipe.") != std::string::npos);
}

// Pure libraries take data and return data. They know neither DDS nor how a GL context is made.
bool is_pure(const Source& source) {
  for (const char* bus_user : {"common/pipeline/bus", "common/pipeline/messages",
                               "common/pipeline/node", "common/recording/replay"})
    if (source.is_in(bus_user)) return false;
  if (top_of(source.path) == "launch" || source.is_in("benchmarks/nodes")) return false;
  return !is_wiring(source);
}

TEST(Layering, OnlyTheBusCallsDds) {
  static const std::regex call("\\bdds_[a-z_]+ *\\(");
  for (const Source& source : production()) {
    if (source.is_in("common/pipeline/bus")) continue;
    for (const std::string& line : source.lines)
      EXPECT_FALSE(std::regex_search(line, call)) << source.path << ": " << line;
    for (const std::string& include : source.includes)
      EXPECT_FALSE(include.starts_with("dds/")) << source.path << " includes " << include;
  }
}

TEST(Layering, PureLibrariesDoNotDependOnDds) {
  for (const Source& source : production()) {
    if (!is_pure(source)) continue;
    for (const std::string& include : source.includes)
      EXPECT_FALSE(include == "fivepipe.h" || include.starts_with("common/pipeline/bus/") ||
                   include.starts_with("common/pipeline/messages/") ||
                   include.starts_with("common/pipeline/node/"))
          << source.path << " includes " << include;
  }
}

TEST(Layering, OnlyProgramsAndTheWindowMakeGlContexts) {
  for (const Source& source : production()) {
    const bool may = source.path.starts_with("common/gl/context.") || source.name == "main.cpp" ||
                     source.name == "doctor.cpp" || source.name.starts_with("bench_") ||
                     source.path.starts_with("render_node/output/window.");
    for (const std::string& include : source.includes)
      EXPECT_TRUE(may || (include != "common/gl/context.h" && include != "epoxy/egl.h" &&
                          include != "EGL/egl.h"))
          << source.path << " includes " << include;
  }
}

TEST(Layering, NodesDoNotDependOnEachOther) {
  for (const Source& source : production())
    for (const std::string& include : source.includes)
      if (is_node(include) && top_of(include) != top_of(source.path)) {
        EXPECT_TRUE(source.is_in("benchmarks")) << source.path << " includes " << include;
      }
}

TEST(Layering, OnlyBenchmarksDependOnBenchmarks) {
  for (const Source& source : production())
    for (const std::string& include : source.includes)
      EXPECT_FALSE(include.starts_with("benchmarks/") && !source.is_in("benchmarks"))
          << source.path << " includes " << include;
}

// A benchmark counts errors against the references alone, not against a method that it compares.
TEST(Layering, TruthOfTheBenchmarksUsesNoMethod) {
  int files = 0;
  for (const Source& source : production()) {
    if (!source.is_in("benchmarks") || !source.name.starts_with("truth.")) continue;
    ++files;
    for (const std::string& include : source.includes)
      EXPECT_TRUE(top_of(include) != "common" || include.starts_with("common/base/") ||
                  include.find("/oracle/") != std::string::npos ||
                  include == "common/collision/detection/detection.h")  // the types of results
          << source.path << " includes " << include;
  }
  EXPECT_EQ(files, 4) << "the truth of the hull and of the collisions was not found";
}

TEST(Layering, CommonDependsOnNoNodeAndNoProgram) {
  for (const Source& source : production())
    for (const std::string& include : source.includes)
      if (source.is_in("common") && include.find('/') != std::string::npos) {
        const bool ours = std::ranges::count(kProduction, top_of(include)) > 0;
        EXPECT_TRUE(!ours || top_of(include) == "common") << source.path << " includes " << include;
      }
}

// Every folder is a vertex, also the subfolders of libraries, nodes, launch and benchmarks.
TEST(Layering, FolderDependenciesAreAcyclic) {
  std::map<std::string, std::map<std::string, std::string>> uses;  // folder, folder, example
  for (const Source& source : production())
    for (const std::string& include : source.includes) {
      if (include.find('/') == std::string::npos || !fs::exists(kRoot / include)) continue;
      const std::string target = fs::path(include).parent_path();
      if (target != source.folder) uses[source.folder].emplace(target, source.path);
    }
  EXPECT_GT(uses.size(), 30u) << "the sources were not found";
  std::set<std::string> done;
  std::vector<std::string> path;
  const std::function<void(const std::string&)> visit = [&](const std::string& folder) {
    if (done.contains(folder)) return;
    if (const auto first = std::ranges::find(path, folder); first != path.end()) {
      std::string cycle;
      for (auto it = first; it != path.end(); ++it) cycle += *it + " -> ";
      ADD_FAILURE() << "cycle: " << cycle << folder << ", by " << uses[path.back()][folder];
      return;
    }
    path.push_back(folder);
    for (const auto& [target, example] : uses[folder]) visit(target);
    path.pop_back();
    done.insert(folder);
  };
  for (const auto& [folder, targets] : std::map(uses)) visit(folder);
}

// An oracle, which the backends are compared with, must not share with them what may hold the same
// error: maps of uniform boxes, bounding volumes, projections with margins. It uses the definitions
// of the hull, cameras and triangles, and nothing else.
bool may_be_in_oracle(const std::string& include) {
  return include.find('/') == std::string::npos || include.starts_with("Eigen/") ||
         include.starts_with("common/geometry/") || include.starts_with("common/base/") ||
         include.starts_with("common/hull/oracle/") ||
         include.starts_with("common/collision/oracle/") || include == "common/hull/hull.h" ||
         include == "common/hull/object_pixels.h" ||
         include == "common/collision/detection/triangle.h";
}

TEST(Layering, OraclesIncludeOnlyDefinitions) {
  int sources = 0;
  for (const Source& source : production()) {
    if (!may_be_in_oracle(source.path)) continue;  // also the headers that an oracle may include
    sources += source.folder.ends_with("/oracle");
    for (const std::string& include : source.includes)
      EXPECT_TRUE(may_be_in_oracle(include) || source.is_in("common/base"))
          << source.path << " includes " << include;
  }
  EXPECT_GT(sources, 6) << "the oracles were not found";
}

// The libraries that each library of common/ links, by name.
std::map<std::string, std::set<std::string>> linked_libraries() {
  static const std::regex library("fivepipe_library\\((\\w+)([^)]*)\\)"), word("\\S+");
  std::map<std::string, std::set<std::string>> linked;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(FIVEPIPE_SOURCE_DIR) / "common")) {
    if (entry.path().filename() != "CMakeLists.txt") continue;
    std::ifstream file(entry.path());
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    for (std::sregex_iterator it(text.begin(), text.end(), library), end; it != end; ++it) {
      const std::string arguments = (*it)[2];
      const std::size_t link = arguments.find("LINK");
      std::set<std::string>& of_library = linked[(*it)[1]];
      if (link == std::string::npos) continue;
      const std::string names = arguments.substr(link + 4);
      for (std::sregex_iterator name(names.begin(), names.end(), word); name != end; ++name)
        of_library.insert(name->str());
    }
  }
  return linked;
}

TEST(Layering, OraclesLinkOnlyDefinitions) {
  const std::set<std::string> allowed = {"fivepipe_hull_oracle", "fivepipe_collision_oracle",
                                         "fivepipe_hull",        "fivepipe_triangle",
                                         "fivepipe_geometry",    "fivepipe_base"};
  const auto linked = linked_libraries();
  for (const char* oracle : {"fivepipe_hull_oracle", "fivepipe_collision_oracle"}) {
    ASSERT_TRUE(linked.contains(oracle));
    for (const std::string& library : linked.at(oracle))
      EXPECT_TRUE(allowed.contains(library)) << oracle << " links " << library;
  }
  for (const char* definitions : {"fivepipe_hull", "fivepipe_triangle", "fivepipe_geometry"})
    for (const std::string& library : linked.at(definitions))
      EXPECT_TRUE(allowed.contains(library)) << definitions << " links " << library;
}

TEST(Layering, MainsOnlyWire) {
  for (const Source& source : production())
    if (source.name == "main.cpp") {
      EXPECT_LT(source.lines.size(), 100u) << source.path;
    }
}

TEST(Layering, TopicNamesAppearOnce) {
  for (const Source& source : production())
    for (const std::string& line : source.lines)
      EXPECT_TRUE(line.find("\"fivepipe/v1/") == std::string::npos ||
                  source.path == "common/pipeline/bus/topics.h")
          << source.path << ": " << line;
}

TEST(Sizes, ProductionFilesHaveAtMost400Lines) {
  for (const Source& source : production()) EXPECT_LE(source.lines.size(), 400u) << source.path;
}

TEST(Sizes, LinesHaveAtMost100Columns) {
  std::vector<std::string> tops = kProduction;
  tops.insert(tops.end(), {"tests", "cmake"});
  // Programs without an extension are scripts.
  for (const Source& source : sources_in(tops, {".h", ".cpp", ".cmake", ".py", ".sh", ""}))
    for (std::size_t i = 0; i < source.lines.size(); ++i) {
      // Columns are characters: bytes that continue a UTF-8 character do not count.
      const auto columns = std::ranges::count_if(
          source.lines[i], [](unsigned char c) { return (c & 0xC0) != 0x80; });
      EXPECT_LE(columns, 100) << source.path << ":" << i + 1;
    }
}

TEST(Sizes, FoldersHoldAtMost25Files) {
  std::map<std::string, int> files;
  std::vector<std::string> tops = kProduction;
  tops.insert(tops.end(), {"tests", "docs", "idl", "scenes"});
  for (const std::string& top : tops)
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top))
      if (entry.is_regular_file()) ++files[fs::relative(entry.path().parent_path(), kRoot)];
  for (const auto& [folder, count] : files)
    if (folder.find("node_modules") == std::string::npos) {
      EXPECT_LE(count, 25) << folder;
    }
}

// A constant is named kCamelCase, with a suffix for its unit: kMaxSpeed_m_s.
TEST(Names, ConstantsAreKCamelCase) {
  static const std::regex constant(
      "^\\s*(?:inline |static )*constexpr [^(]*?\\b(\\w+)(?:\\[[^\\]]*\\])?(?: = |\\{).*");
  static const std::regex good("k[A-Z]\\w*");
  int constants = 0;
  for (const Source& source : production()) {
    if (source.path == "common/pipeline/bus/topics.h") continue;  // traits of types: Topic::name
    for (const std::string& line : source.lines) {
      std::smatch match;
      if (!std::regex_match(line, match, constant)) continue;
      ++constants;
      EXPECT_TRUE(std::regex_match(match[1].str(), good)) << source.path << ": " << line;
    }
  }
  EXPECT_GT(constants, 100) << "the constants were not found";
}

}  // namespace
}  // namespace fivepipe::test
