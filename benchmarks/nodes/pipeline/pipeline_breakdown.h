// Splits the time from a frame's first message to its composite into stages, by the account of the
// nodes (FrameTrace). Pure.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/recording/replay/frame_times.h"

namespace fivepipe::node_bench {

struct PipelineNodes {
  std::vector<std::string> reconstruction;
  std::string simulation, rendering;
  std::string capture;  // empty: a replay sends its messages
};

// The stages, in order. The steps of a node (capture, publish, reconstruct, write_tiles, render)
// are stages of the same name.
namespace stage {
inline constexpr const char* kCapture = "capture";
inline constexpr const char* kPublish = "publish";
inline constexpr const char* kSend = "send inputs";  // instead of capture and publish: a replay
inline constexpr const char* kReconBusy = "reconstruction busy with frames before";
inline constexpr const char* kReconBus = "bus to reconstruction";
inline constexpr const char* kReconInputs = "reconstruction reads its inputs";
inline constexpr const char* kReconstruct = "reconstruct";
inline constexpr const char* kWriteTiles = "write_tiles";
inline constexpr const char* kRenderBusy = "rendering busy with frames before";
inline constexpr const char* kRenderBus = "bus to rendering";
inline constexpr const char* kSimulation = "waiting for the simulation";
inline constexpr const char* kRenderInputs = "rendering reads its inputs";
inline constexpr const char* kRender = "render";
}  // namespace stage

// The consecutive stages of one frame [ms].
using FrameStages = std::vector<std::pair<std::string, double>>;

// Times in ms, one per frame.
struct PipelineBreakdown {
  // The critical path. It passes through the reconstruction node whose tiles were written last.
  std::vector<std::pair<std::string, std::vector<double>>> stages;
  // From the first message sent, or the start of the capture, to the timestamp of FrameComposited.
  std::vector<double> latency;
  // From the same start until the benchmark received FrameComposited.
  std::vector<double> received;
  // In parallel to the path: from the simulation's last input until its state was written.
  std::vector<double> simulation;
  std::size_t waited_for_state = 0;  // frames whose tiles arrived before the simulation's state
  std::map<std::uint64_t, FrameStages> by_frame;  // of this run only
  double stages_mean_ms() const;
  // The fraction of the mean of `received` that the stages explain; the rest is the transport of
  // FrameComposited. 0 if nothing was received.
  double explained_fraction() const;
  void add(const PipelineBreakdown& other);  // appends the times of another run
};
PipelineBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames,
                               const PipelineNodes& nodes);

}  // namespace fivepipe::node_bench
