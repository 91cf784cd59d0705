// Tables of the pipeline and of single nodes.
#include <fmt/format.h>

#include <stdexcept>

#include "benchmarks/figures/documents.h"
#include "benchmarks/figures/numbers.h"

namespace fivepipe::figures {
namespace {

struct PipelineRow {
  std::string text, images;
  const char *file, *deployment;  // docs/benchmarks/FILE.json
  const char* hull_method;        // of the depth's error, in the view of 320x240
};

const char* const kPrepared = "segmented before the start";

std::vector<PipelineRow> pipeline_rows(const std::string& gl) {
  return {{"exact volume queries on the CPU (`cpu`), tiles balanced by cost", kPrepared,
           "paper_tiles", "paper", "cpu"},
          {"the same, tiles round-robin", kPrepared, "paper_round_robin", "paper", "cpu"},
          {"the same, whole frames round-robin", kPrepared, "paper_frames", "paper", "cpu"},
          {"the paper's plane sweep on " + gl + ", 64 planes", kPrepared, "paper_sweep", "paper",
           "glsweep64"},
          {"`cpu`, tiles balanced by cost", "JPEG files, decoded and segmented by capture_node",
           "paper_files", "paper_files", "cpu"}};
}

std::string percentiles(const json& latency) {
  return fmt::format("{:.0f} / {:.0f} / {:.0f} ms", time_ms(latency, "median"),
                     time_ms(latency, "p95"), time_ms(latency, "p99"));
}

std::string pipeline(const Results& results) {
  MarkdownTable table({"reconstruction", "images of the cameras", "frames/s",
                       "capture to composite, p50 / p95 / p99",
                       "mean error of this method in scene hand4-near at 320x240"});
  for (const PipelineRow& row : pipeline_rows(results.gl_name())) {
    const json& latency =
        results.at(row.file, fmt::format("pipeline_with_capture/{}/latency", row.deployment));
    const json& depth = results.at("hull", fmt::format("{}/hand4-near/320x240/2", row.hull_method));
    table.add({row.text, row.images, fmt::format("{:.1f}", count_of(latency, "frames_per_s")),
               percentiles(latency), error_mm(error_of(depth, "depth_mean_mm"))});
  }
  return table.text();
}

std::string replay(const Results& results) {
  const auto sentence = [&](const char* file) {
    const json& latency = results.at(file, "pipeline/paper/latency");
    return fmt::format("{:.0f} frames/s with a p50 of {:.0f} ms", count_of(latency, "frames_per_s"),
                       time_ms(latency, "median"));
  };
  return wrapped(
      fmt::format("In a replay without capture_node and with `collision: cpu` "
                  "([results](docs/benchmarks/pipeline.json)), two frames in flight give {}; one "
                  "frame in flight gives {}.",
                  sentence("pipeline"), sentence("pipeline_1")));
}

// The account of the nodes beside the times from outside, of each run of the pipeline.
std::string account(const Results& results) {
  struct Run {
    std::string text, file, prefix;
  };
  std::vector<Run> runs = {
      {"replay, `collision: cpu`, one frame in flight", "pipeline_1", "pipeline/paper/"},
      {"replay, `collision: cpu`, two frames in flight", "pipeline", "pipeline/paper/"},
      {"with capture_node, images from files, `collision: paper`", "paper_files",
       "pipeline_with_capture/paper_files/"}};
  MarkdownTable table({"run", "stage", "frames", "by the nodes, ms", "outside, ms",
                       "difference, ms", "its limit, ms", "p5 / p95 of the difference, ms",
                       "their limit, ms"});
  bool agree = true;
  for (const Run& run : runs) {
    std::size_t stages = 0;
    for (const json& result : results.all(run.file)) {
      const std::string name = result.at("name"), prefix = run.prefix + "outside/";
      if (!name.starts_with(prefix)) continue;
      const double own_ms = count_of(result, "nodes_mean_ms"),
                   outside_ms = count_of(result, "outside_mean_ms");
      const bool agrees = result.at("counts").at("agrees").get<bool>();
      agree &= agrees;
      table.add({run.text, name.substr(prefix.size()), count_text(count_of(result, "frames")),
                 fmt::format("{:.3f}", own_ms), fmt::format("{:.3f}", outside_ms),
                 fmt::format("{:.3f}{}", outside_ms - own_ms, agrees ? "" : " DIFFERS"),
                 fmt::format("{:.3f}", count_of(result, "limit_ms")),
                 fmt::format("{:.3f} / {:.3f}", count_of(result, "difference_p5_ms"),
                             count_of(result, "difference_p95_ms")),
                 fmt::format("{:.3f}", count_of(result, "tail_limit_ms"))});
      ++stages;
    }
    // Without CAP_NET_RAW the benchmark measures none.
    if (stages == 0)
      throw std::runtime_error(run.file + ".json has no result " + run.prefix + "outside/");
  }
  return table.text() + "\n" +
         (agree ? "All stages agree within both limits.\n" : "NOT all stages agree.\n");
}

std::string nodes(const Results& results) {
  MarkdownTable table({"node", "step", "p50, ms", "p95, ms", "p99, ms"});
  for (const char* file : {"recon_a", "simulation", "rendering"})
    for (const json& result : results.all(file)) {
      const std::string name = result.at("name");
      table.add({file, name.substr(name.rfind('/') + 1),
                 fmt::format("{:.3f}", time_ms(result, "median")),
                 fmt::format("{:.3f}", time_ms(result, "p95")),
                 fmt::format("{:.3f}", time_ms(result, "p99"))});
    }
  return table.text();
}

// Results are named security/BYTES/PROTECTION.
std::string security(const Results& results) {
  MarkdownTable table({"message, bytes", "protection", "latency p50, ms", "p99, ms",
                       "processor time of sender and receiver, ms per message", "lost"});
  for (const json& result : results.all("security")) {
    const std::string name = result.at("name");
    const std::size_t size_at = name.find('/') + 1, protection_at = name.find('/', size_at) + 1;
    table.add({count_text(std::stod(name.substr(size_at))), name.substr(protection_at),
               fmt::format("{:.2f}", time_ms(result)),
               fmt::format("{:.2f}", time_ms(result, "p99")),
               fmt::format("{:.2f}", count_of(result, "cpu_us_per_message") / 1000),
               count_text(error_of(result, "lost"))});
  }
  return table.text();
}

}  // namespace

std::map<std::string, Block> pipeline_blocks() {
  return {{"pipeline", pipeline},
          {"replay", replay},
          {"account", account},
          {"nodes", nodes},
          {"security", security}};
}

}  // namespace fivepipe::figures
