#include "benchmarks/nodes/node_processes.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "common/recording/replay/node_inputs.h"
#include "launch/supervise/own_files.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStopTimeout = 2s;

double peak_memory_mb_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) * 1024e-6;
  return 0;
}

}  // namespace

double cpu_s_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string skipped;
  double user = 0, system = 0;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  fields >> user >> system;
  return (user + system) / double(sysconf(_SC_CLK_TCK));
}

NodeProcesses::NodeProcesses(const NodesToStart& options, std::uint32_t domain) {
  // By default, llvmpipe starts a thread per core in every process that draws.
  setenv("LP_NUM_THREADS", "1", 0);
  for (const std::string& name : options.nodes) {
    const config::Node* node = config::find_node(*options.deployment, name);
    std::vector<std::string> words{launch::program_folder() / config::program_of(*node),
                                   "--deployment",
                                   options.file,
                                   "--node",
                                   name,
                                   "--domain",
                                   std::to_string(domain),
                                   "--out",
                                   options.out,
                                   "--local"};
    for (const auto& [key, value] : options.settings)
      words.insert(words.end(), {"--set", key + "=" + value});
    children_.emplace(name, std::make_unique<launch::ChildProcess>(words, node->cores));
  }
}

void NodeProcesses::check() {
  for (auto& [name, child] : children_) {
    for (std::string& line : child->read_lines()) output_[name] += "\n  " + line;
    if (const auto exit = child->ended())
      throw std::runtime_error("node '" + name + "' ended: " + launch::to_string(*exit) +
                               output_[name]);
  }
}

std::map<std::string, pid_t> NodeProcesses::pids() const {
  std::map<std::string, pid_t> pids;
  for (const auto& [name, child] : children_) pids[name] = child->pid();
  return pids;
}

std::map<std::string, ProcessUse> NodeProcesses::use() const {
  std::map<std::string, ProcessUse> use;
  for (const auto& [name, child] : children_)
    use[name] = {cpu_s_of(child->pid()), peak_memory_mb_of(child->pid())};
  return use;
}

std::map<std::string, ProcessUse> NodeProcesses::use_since(
    const std::map<std::string, ProcessUse>& before) const {
  std::map<std::string, ProcessUse> now = use();
  for (auto& [name, used] : now) used.cpu_s -= before.at(name).cpu_s;
  return now;
}

void NodeProcesses::stop() {
  for (auto& [name, child] : children_) child->signal_group(SIGTERM);
  const auto until = Clock::now() + kStopTimeout;
  const auto runs = [](auto& child) { return !child.second->ended(); };
  while (Clock::now() < until && std::any_of(children_.begin(), children_.end(), runs))
    std::this_thread::sleep_for(10ms);
  children_.clear();  // kills the remaining processes
}

std::string missing_endpoint(bus::Bus& bus, const NodesToStart& options) {
  std::map<std::string, std::set<std::string>> reads, writes;  // by node
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    (endpoint.writes ? writes : reads)[endpoint.participant].insert(endpoint.topic);
  for (const std::string& name : options.nodes) {
    const config::Node& node = *config::find_node(*options.deployment, name);
    for (const std::string& topic : replay::inputs_of(*options.deployment, node))
      if (!reads[name].contains(topic)) return "node '" + name + "' does not read " + topic;
    for (const std::string& topic : replay::outputs_of(*options.deployment, node))
      if (!writes[name].contains(topic)) return "node '" + name + "' does not write " + topic;
  }
  return "";
}

}  // namespace fivepipe::node_bench
