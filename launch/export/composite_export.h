// The composited video of a recording: render_node draws it again from the recorded messages.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>

#include "common/recording/replay/recorded_deployment.h"

namespace fivepipe::exports {

// Of which messages, in seconds since the start of the recording; nullopt: to its end.
struct CompositeRange {
  double start_s = 0;
  std::optional<double> end_s = {};
};

// Throws base::UsageError if the deployment has no render_node for its viewer that writes a video,
// or is secured, or if the range has no messages.
void check_composites(const recording::Recording& recording,
                      const replay::RecordedDeployment& recorded, const CompositeRange& range);

// Starts the recording's render_node in a DDS domain of its own and replays its inputs to it, at
// the recorded rate, because the encoder of the video drops frames that come faster than it works.
// The node writes composite.mp4 and composite.png into the folder. Returns the number of composited
// frames. Call it from the main thread, after launch::catch_signals(): a signal ends it.
//
// Throws as check_composites() does; recording::RecordingError if the recording lacks inputs of the
// node, such as HullTile after `record --no-colour`; std::runtime_error if the node ends early.
std::size_t export_composites(const recording::Recording& recording,
                              const replay::RecordedDeployment& recorded,
                              const std::filesystem::path& folder, const CompositeRange& range);

}  // namespace fivepipe::exports
