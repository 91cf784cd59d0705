// The processes of the nodes that a benchmark measures.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "launch/supervise/process.h"

namespace fivepipe::node_bench {

struct NodesToStart {
  const config::Deployment* deployment = nullptr;
  std::filesystem::path file;                   // of the deployment
  std::map<std::string, std::string> settings;  // of the deployment
  std::vector<std::string> nodes;
  std::filesystem::path out;  // the folder for the nodes' files and logs
};

struct ProcessUse {
  double cpu_s = 0;           // user and system time
  double peak_memory_mb = 0;  // resident, since the start of the process
};
double cpu_s_of(pid_t pid);  // user and system time

// Returns a message that names the first input or output of the nodes that discovery has not found;
// empty if it has found all.
std::string missing_endpoint(bus::Bus& bus, const NodesToStart& options);

class NodeProcesses {
 public:
  NodeProcesses(const NodesToStart& options, std::uint32_t domain);
  ~NodeProcesses() { stop(); }
  NodeProcesses(const NodeProcesses&) = delete;
  NodeProcesses& operator=(const NodeProcesses&) = delete;

  // Throws std::runtime_error with the node's output if a node has ended.
  void check();
  std::map<std::string, pid_t> pids() const;  // by node
  std::map<std::string, ProcessUse> use() const;
  // The use since `before`, an earlier result of use().
  std::map<std::string, ProcessUse> use_since(
      const std::map<std::string, ProcessUse>& before) const;
  void stop();

 private:
  std::map<std::string, std::unique_ptr<launch::ChildProcess>> children_;
  std::map<std::string, std::string> output_;
};

}  // namespace fivepipe::node_bench
