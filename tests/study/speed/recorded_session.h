// A recorded session of the deployment payload, and single replays of layouts on it.
#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "common/collision/detection/detection.h"
#include "common/recording/replay/recorded_frames.h"
#include "tests/study/truth/session.h"

namespace fivepipe::test {

// Records the maps of the scripted session's exact silhouettes: `frames` frames at 30 Hz from
// start_s on.
void record_session(const Session& session, const std::filesystem::path& file, int frames,
                    double start_s);

// The frames of a recording. The person repeats the task, so several have the same maps.
struct RecordedMaps {
  struct Frame {
    std::size_t maps;  // index into `different`
    double duration_s;
  };
  std::vector<std::vector<hull::Silhouette>> different;
  std::vector<Frame> frames;
};
RecordedMaps maps_of(const std::filesystem::path& recording, const config::Deployment& deployment);

// Layouts as sim_node detects them: one object, frame by frame, by backend cpu. Maps that several
// frames have are detected once.
struct SingleReplays {
  struct Layout {
    std::size_t colliding_frames = 0, undecided_frames = 0;
    double collision_s = 0;  // summed in the order of the frames
  };
  std::vector<Layout> layouts;                                     // by spacing
  std::vector<std::vector<collision::CollisionVerdict>> verdicts;  // by maps and spacing
};
SingleReplays single_replays(const RecordedMaps& recorded, const collision::MovablePart& part,
                             std::span<const double> spacings_m, const hull::HullRule& rule,
                             double eps_m);

// Bounds of the distance between the part and the hull by the exact reference, without hull
// queries, at most cap_m: from below the distance to the cone of one camera, from above those of
// points of the part. They are often millimetres apart.
study::Bracket reference_clearance_m(std::span<const hull::Silhouette> silhouettes,
                                     const collision::MovablePart& part, double spacing_m,
                                     double cap_m);

}  // namespace fivepipe::test
