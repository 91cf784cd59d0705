#include "launch/export/composite_export.h"

#include <csignal>
#include <stdexcept>

#include "common/base/usage_error.h"
#include "common/recording/replay/replay_session.h"
#include "launch/supervise/hosts/free_domain.h"
#include "launch/supervise/interrupt.h"
#include "launch/supervise/own_files.h"
#include "launch/supervise/process.h"

namespace fivepipe::exports {
namespace {

// render_node encodes the rest of its video before it ends.
constexpr std::chrono::seconds kEndTimeout{10};

const config::Node& renderer_of(const config::Deployment& deployment) {
  if (deployment.security)
    throw base::UsageError(
        "--composites: the recorded deployment is secured, so only programs with its keys can "
        "draw it; replay it to its render_node");
  for (const config::Node& node : deployment.nodes)
    if (const auto* render = std::get_if<config::RenderConfig>(&node.config);
        render && config::draws_for_viewer(node)) {
      if (render->video) return node;
      throw base::UsageError("--composites: node '" + node.name + "' has video: false");
    }
  throw base::UsageError("--composites: the recorded deployment has no render_node for its viewer");
}

// A node and what it prints.
class Renderer {
 public:
  Renderer(const replay::RecordedDeployment& recorded, const config::Node& node,
           std::uint32_t domain, const std::filesystem::path& folder)
      : child_(words_of(recorded, node, domain, folder), node.cores) {}

  // Throws if the node has ended.
  void check() {
    take_output();
    if (const auto exit = child_.ended())
      throw std::runtime_error("render_node ended: " + launch::to_string(*exit) + output_);
  }
  void stop() {
    child_.signal_group(SIGINT);
    if (!child_.wait_for_end(kEndTimeout))
      throw std::runtime_error("render_node does not end; its video may be incomplete" + output_);
  }

 private:
  static std::vector<std::string> words_of(const replay::RecordedDeployment& recorded,
                                           const config::Node& node, std::uint32_t domain,
                                           const std::filesystem::path& folder) {
    setenv("LP_NUM_THREADS", "1", 0);  // llvmpipe would start a thread per core
    std::vector<std::string> words{launch::program_folder() / config::program_of(node),
                                   "--deployment",
                                   recorded.file(),
                                   "--node",
                                   node.name,
                                   "--domain",
                                   std::to_string(domain),
                                   "--out",
                                   folder,
                                   "--local"};
    for (const auto& [key, value] : recorded.settings())
      words.insert(words.end(), {"--set", key + "=" + value});
    return words;
  }
  void take_output() {
    for (const std::string& line : child_.read_lines()) output_ += "\n  " + line;
  }

  launch::ChildProcess child_;
  std::string output_;
};

replay::ReplayRequest request_for(const replay::RecordedDeployment& recorded,
                                  const config::Node& node, const CompositeRange& range) {
  replay::ReplayRequest request;
  request.nodes = {node.name};
  request.settings = recorded.settings();
  request.start_s = range.start_s;
  request.end_s = range.end_s;
  request.lossless = true;
  request.deployment = recorded.deployment().name;
  return request;
}

}  // namespace

void check_composites(const recording::Recording& recording,
                      const replay::RecordedDeployment& recorded, const CompositeRange& range) {
  replay::plan_for(recording, request_for(recorded, renderer_of(recorded.deployment()), range));
}

std::size_t export_composites(const recording::Recording& recording,
                              const replay::RecordedDeployment& recorded,
                              const std::filesystem::path& folder, const CompositeRange& range) {
  const config::Node& node = renderer_of(recorded.deployment());
  replay::ReplayRequest request = request_for(recorded, node, range);
  replay::plan_for(recording, request);  // throws before a node starts
  request.domain = launch::free_domain();
  std::filesystem::create_directories(folder);
  Renderer renderer(recorded, node, request.domain, folder);
  std::size_t frames = 0;
  const replay::ReplayResult result = replay::replay(
      recording, request,
      {.control =
           [&] {
             renderer.check();
             return launch::signals_received() > 0 ? replay::ReplayControl::stop
                                                   : replay::ReplayControl::resume;
           },
       .interrupted = [] { return launch::signals_received() > 0; },
       .on_round =
           [&](const replay::ReplayCounts& counts) { frames = counts.handled.at(node.name); }});
  renderer.check();
  renderer.stop();
  if (result.end == replay::ReplayResult::End::complete && frames > 0) return frames;
  if (result.end == replay::ReplayResult::End::stopped) throw std::runtime_error("interrupted");
  throw recording::RecordingError(
      recording.file().string() + " cannot be composited completely: " +
      (result.message.empty() ? "inputs of render_node are missing, such as HullTile after record "
                                "--no-colour"
                              : result.message));
}

}  // namespace fivepipe::exports
