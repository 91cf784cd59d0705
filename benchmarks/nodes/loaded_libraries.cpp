#include "benchmarks/nodes/loaded_libraries.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "benchmarks/nodes/node_processes.h"
#include "common/pipeline/bus/bus.h"
#include "launch/supervise/hosts/free_domain.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The time that nodes may need to load shaders, and capture_node for its reference images.
constexpr auto kFramesTimeout = 120s;

std::vector<std::string> minus(const Libraries& from, const Libraries& other) {
  std::vector<std::string> rest;
  std::set_difference(from.begin(), from.end(), other.begin(), other.end(),
                      std::back_inserter(rest));
  return rest;
}

Libraries of_program(const std::map<std::string, Libraries>& all, const std::string& program) {
  const auto found = all.find(program);
  return found == all.end() ? Libraries{} : found->second;
}

}  // namespace

Libraries loaded_libraries(pid_t pid) {
  std::ifstream maps("/proc/" + std::to_string(pid) + "/maps");
  Libraries libraries;
  for (std::string line; std::getline(maps, line);) {
    const std::string name = line.substr(line.rfind('/') + 1);
    if (line.find('/') != line.npos && (name.ends_with(".so") || name.find(".so.") != name.npos))
      libraries.insert(name);
  }
  return libraries;
}

std::map<std::string, Libraries> libraries_of_nodes(const std::filesystem::path& deployment,
                                                    const std::filesystem::path& out) {
  const config::Deployment loaded = config::load_deployment(deployment);
  const std::uint32_t domain = launch::free_domain();
  bus::Bus bus({.domain = domain, .participant = "bench"});
  auto composited = bus.reader<bus::topics::FrameComposited>();
  NodesToStart to_start{
      .deployment = &loaded, .file = deployment, .settings = {}, .nodes = {}, .out = out};
  for (const config::Node& node : loaded.nodes) to_start.nodes.push_back(node.name);
  NodeProcesses nodes(to_start, domain);
  const auto until = Clock::now() + kFramesTimeout;
  for (int frames = 0; frames < kLiveFrames; bus.wait(20ms)) {
    if (Clock::now() >= until)
      throw std::runtime_error(fmt::format("{} of {} frames were composited within {}", frames,
                                           kLiveFrames, kFramesTimeout));
    nodes.check();
    for (const auto& frame : composited.take()) frames += frame.valid();
  }
  std::map<std::string, Libraries> libraries;
  for (const auto& [name, pid] : nodes.pids())
    libraries[config::program_of(*config::find_node(loaded, name))] = loaded_libraries(pid);
  return libraries;
}

std::string difference_text(const std::map<std::string, Libraries>& base,
                            const std::map<std::string, Libraries>& other) {
  std::map<std::string, Libraries> programs = base;
  programs.insert(other.begin(), other.end());
  std::vector<std::string> texts;
  for (const auto& [program, ignored] : programs) {
    std::vector<std::string> names;
    const Libraries before = of_program(base, program), after = of_program(other, program);
    for (const std::string& added : minus(after, before)) names.push_back("+" + added);
    for (const std::string& gone : minus(before, after)) names.push_back("-" + gone);
    if (!names.empty()) texts.push_back(fmt::format("{}: {}", program, fmt::join(names, " ")));
  }
  return texts.empty() ? "the same" : fmt::format("{}", fmt::join(texts, "; "));
}

}  // namespace fivepipe::node_bench
