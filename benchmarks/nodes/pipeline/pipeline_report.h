// The results of the pipeline benchmark, as text and as JSON.
#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "benchmarks/nodes/bus_ping.h"
#include "benchmarks/nodes/node_processes.h"
#include "benchmarks/nodes/pipeline/outside_times.h"
#include "benchmarks/nodes/pipeline/pipeline_breakdown.h"
#include "benchmarks/nodes/run_observer.h"

namespace fivepipe::node_bench {

// One run, or the sum of several.
struct PipelineResult {
  PipelineBreakdown breakdown;
  std::vector<StageAgreement> agreement;  // empty if the bus was not traced
  std::uint64_t frames = 0;               // composited
  double seconds = 0;
  double replay_cpu_s = 0;  // of the replay in this process; 0: capture_node runs
  std::string gl_renderer;
  void add(const PipelineResult& other);
};

void print_stages(const PipelineResult& result);
// The account of the nodes beside the times taken outside them, or why there are none.
void print_agreement(const std::vector<StageAgreement>& stages, const std::string& no_messages);
void print_resources(const PipelineResult& result, const std::map<std::string, ProcessUse>& use,
                     const RunObservations& observed);
void print_bus(const std::vector<BusTimes>& bus);

// Entries of the result file. `counts` is added to those of the latency.
nlohmann::ordered_json results_json(const PipelineResult& result, const std::string& prefix,
                                    const nlohmann::ordered_json& counts);
nlohmann::ordered_json bus_json(const std::vector<BusTimes>& bus);

}  // namespace fivepipe::node_bench
